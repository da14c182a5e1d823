// The programs of one simulation, for the page that shows and changes them (protocol section 13.19).
#pragma once

#include "async/wakeup.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/editable_files.hpp"
#include "session_context.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <memory>
#include <optional>
#include <string>

namespace webots_cloud {

/// Lifetime: everything passed by reference must outlive it.
class SimulationPrograms
{
public:
    /// `project` and `simulation`: those of the session, which come and go.
    SimulationPrograms(SessionContext& context, boost::asio::any_io_executor const& executor,
                       std::optional<Project> const& project, std::unique_ptr<Simulation> const& simulation)
        : context_(context), project_(project), simulation_(simulation), wished_(executor)
    {}

    /// Takes the programs and the lesson of the world as they were fetched, before a simulator runs that
    /// could have changed them.
    ///
    /// Precondition: there is a project.
    boost::asio::awaitable<void> read();

    /// Its page can't show them.
    void forget();

    /// Sends the page that can show them what there is to change, and the lesson.
    void list(Channel& channel) const;

    void show(core::ReadFileMessage const& wish, Channel& channel) const;
    boost::asio::awaitable<void> save(core::WriteFileMessage program, Channel& channel);

    /// Has `compile_wishes` compile a controller, or tells the page why not.
    void wish(core::CompileMessage const& message, Channel& channel);

    /// Compiles what the page wishes, one after the other, until it is cancelled: with the connection of the
    /// page, so that nothing is compiled for somebody who has left.
    boost::asio::awaitable<void> compile_wishes(Channel& channel);

    /// Puts a file back as it was fetched, whether or not the page may change it.
    ///
    /// Precondition: there is a project.
    boost::asio::awaitable<result<>> restore(std::string file);

private:
    bool can_compile() const { return !context_.launcher.facts().compiler.make.empty(); }
    boost::asio::awaitable<void> compile(Channel& channel);

    SessionContext& context_;
    std::optional<Project> const& project_;
    std::unique_ptr<Simulation> const& simulation_;
    std::optional<core::EditableFiles> files_; ///< Once fetched; absent: its page can't change them.
    std::string wish_;     ///< The controller that is to be compiled, or is being compiled; empty: none.
    async::Wakeup wished_; ///< There is one.
    std::string lesson_;   ///< What its page is told of the lesson, or of its faults; empty: there is none.
};

} // namespace webots_cloud
