// Has simulations of the configured worlds ready before anybody asks, and gives them to browsers.
#pragma once

#include "async/task_count.hpp"
#include "async/wakeup.hpp"
#include "core/simulation/staging.hpp"
#include "simulation_session.hpp"

#include <webots_cloud/project_fetcher.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>

namespace webots_cloud {

/// Staged simulations are sessions as others are, but count in no limit: a browser that needs the seat of
/// one gets it.
///
/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class Stager
{
public:
    /// `new_id`: of a session.
    Stager(SessionContext& context, SimulationSessions& sessions, std::function<std::uint64_t()> new_id);

    /// To be called when the configuration has changed.
    void apply();

    /// Stages and gives back, until it is cancelled; then nothing staged is left.
    ///
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// A simulation that is ready for this browser, and is its own from now on: to be resumed. Null: it has
    /// to be started.
    boost::asio::awaitable<std::shared_ptr<SimulationSession>> take(std::string quota_key,
                                                                    core::SimulationRequest request);

    /// Waits until a browser that has a place has a seat as well: staged simulations that are being ended
    /// still have theirs.
    boost::asio::awaitable<void> await_seat();

    /// A browser has got a place, or something else has changed: looks at once, not only every second.
    void on_change();

    void on_fetch(std::uint64_t id, Project const& project);
    void on_ready(std::uint64_t id);

private:
    void act();
    core::StagingRoom room() const;
    boost::asio::awaitable<void> prepare(std::uint64_t id, core::SimulationRequest request);

    SessionContext& context_;
    SimulationSessions& sessions_;
    std::function<std::uint64_t()> new_id_;
    core::Staging staging_;
    std::optional<async::TaskCount> tasks_; ///< Set while `run` runs, as the next one.
    std::optional<async::Wakeup> changed_;
    std::list<async::Wakeup*> seat_waits_;
};

} // namespace webots_cloud
