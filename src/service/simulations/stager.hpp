// Has simulations ready before anybody asks, of the worlds that the configuration names and those of classes
// of session servers, and gives them to browsers.
#pragma once

#include "async/task_count.hpp"
#include "async/wakeup.hpp"
#include "core/pace.hpp"
#include "core/simulation/staging.hpp"
#include "core/simulation/staging_messages.hpp"
#include "simulation_session.hpp"

#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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

    /// To be called when the configuration has changed: lists what is wanted anew.
    void apply();

    /// Stages and gives back, until it is cancelled; then nothing staged is left.
    ///
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// A session server has simulations staged for its classes, as long as it is connected and says so again
    /// within `longest_silence`. It is told how many are ready whenever that changes.
    boost::asio::awaitable<void> serve(std::uint64_t id, std::vector<core::StagingWish> wishes,
                                       Channel& channel);

    static constexpr Duration longest_silence = std::chrono::seconds(30);

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
    /// A world that a session server wants staged.
    struct Wish
    {
        core::StagingWish wanted; ///< Its count is what is still to be ready.
        std::string address;      ///< Of the world, however it is written; empty: it is none of ours.
        int taken = 0;
    };

    struct Wisher
    {
        Channel* channel = nullptr;
        std::vector<Wish> wishes;
        std::string told;
        core::Pace messages;
    };

    boost::asio::awaitable<result<>> act_on_changes();
    boost::asio::awaitable<result<>> watch_folders();
    boost::asio::awaitable<result<>> look_at_folders();
    void act();
    void take_wishes(Wisher& wisher, std::vector<core::StagingWish> wishes) const;
    void count_taken(std::string const& address, std::string const& mode);
    void tell_wishers();
    core::StagingRoom room() const;
    boost::asio::awaitable<void> prepare(std::uint64_t id, core::SimulationRequest request);

    SessionContext& context_;
    SimulationSessions& sessions_;
    std::function<std::uint64_t()> new_id_;
    core::Staging staging_;
    std::map<std::uint64_t, Wisher> wishers_; ///< By their connection: those that came first come first.
    std::optional<async::TaskCount> tasks_;   ///< Set while `run` runs, as the next one.
    std::optional<async::Wakeup> changed_;
    std::list<async::Wakeup*> seat_waits_;
};

} // namespace webots_cloud
