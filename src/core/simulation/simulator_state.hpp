// What a started simulator has reached, and when it must be ended.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <optional>
#include <string_view>

namespace webots_cloud::core {

/// A state machine without a clock: its owner reports what the simulator does, and when, and ends it when
/// told to.
///
/// A simulator loads its world, then opens its port, and then it is ready. It can be stopped at any time, and
/// can end at any time.
class SimulatorState
{
public:
    enum class State
    {
        loading, ///< Until its first sign of life.
        opening, ///< The world is loaded; it does not listen yet.
        ready,   ///< A browser can connect.
        stopping,
        ended
    };

    /// What to do with a sign of life.
    enum class Heartbeat
    {
        ignore,
        pass_on,        ///< The browser is to know it.
        world_is_loaded ///< The first one: look whether it listens.
    };

    /// What to do at a deadline.
    enum class Due
    {
        nothing,
        look_for_port,
        stop_at_time_limit,
        stop_without_port, ///< It has not opened its port in time.
        stop_unloaded      ///< It has not loaded the world in time.
    };

    /// How long to wait between looks for the port: an eighth of the time since the first one, and neither
    /// less nor more than this. So it is found at most an eighth too late.
    static constexpr auto shortest_pause = std::chrono::milliseconds(1);
    static constexpr auto longest_pause = std::chrono::milliseconds(200);

    /// `start_timeout` begins now, and again with each `start_goes_on`; `timeout` is the longest life, which
    /// can be extended by `extendable` in all.
    SimulatorState(TimePoint now, Duration start_timeout, Duration timeout, Duration extendable = {})
        : start_timeout_(start_timeout), timeout_(timeout), extendable_(extendable), ends_at_(now + timeout)
    {
        start_goes_on(now);
    }

    /// The start takes longer for a good reason: containers are being built.
    void start_goes_on(TimePoint now);

    /// The start waits for a machine: no time limit holds until `begins`.
    void waits() { waits_ = true; }

    /// It has a machine: all times begin now.   Returns: false when it has not waited.
    bool begins(TimePoint now);

    /// Its longest life begins now: nobody has used it before.
    void restart_life(TimePoint now) { ends_at_ = now + timeout_; }

    Heartbeat heartbeat(TimePoint now);

    /// Somebody will say when the port is open: nobody has to look for it.
    void is_told_of_port() { is_told_ = true; }

    /// The owner has looked for the port in vain.
    void looked_for_port(TimePoint now);

    /// The port is open.   Returns: whether the simulator is ready now; not when it is being stopped.
    bool port_opened();

    /// The simulation runs, or is paused.   Returns: whether to tell the browser now; otherwise it is kept
    /// until the simulator is ready.
    bool activity(bool running);

    /// What was reported before the simulator was ready.
    std::optional<bool> early_activity() const noexcept { return early_activity_; }

    /// The simulation was reset: its controller is to be restarted.
    void reset() { restart_wanted_ = true; }

    /// Whether to restart the controller now; true once for each `reset`, or several.
    bool take_restart();

    /// Extends the longest life by what is asked for, or by what is left of what it can be extended by.
    /// Returns: by how much.
    Duration extend(Duration asked) noexcept;

    /// By how much it can still be extended.
    Duration extendable() const noexcept;

    /// `reason` is what the browser is told.   Returns: false when the simulator is being stopped already,
    /// or has ended; then the first reason stays.
    bool stop(Failure reason) noexcept;

    /// Why a simulator has ended: the reason why it was stopped, or else a sentence about `how` it ended,
    /// which was `expected` or not. `last_words` is what it printed last.
    Failure end_reason(std::string_view how, bool expected, std::string_view last_words) const;

    void exited() { state_ = State::ended; }

    /// When to ask what is due; `max()`: never.
    TimePoint deadline() const noexcept;
    Due due(TimePoint now) const noexcept;

    /// What the browser is told about one of the three reasons to stop.
    Failure stop_reason(Due due) const;

    State state() const noexcept { return state_; }
    bool is_waiting() const noexcept { return waits_ && state_ == State::loading; }
    bool was_ready() const noexcept { return was_ready_; } ///< Also when it is being stopped, or has ended.
    TimePoint ends_at() const noexcept { return ends_at_; }

    /// The start goes on: neither ready nor being stopped.
    bool is_starting() const noexcept { return state_ == State::loading || state_ == State::opening; }

private:
    Duration start_timeout_;
    Duration timeout_;
    Duration extendable_;
    TimePoint ends_at_;
    TimePoint ready_by_;
    TimePoint first_look_ = TimePoint::max();
    TimePoint next_look_ = TimePoint::max();
    State state_ = State::loading;
    bool was_ready_ = false;
    bool restart_wanted_ = false;
    bool waits_ = false;
    bool is_told_ = false;
    std::optional<bool> early_activity_;
    Failure stop_reason_;
};

} // namespace webots_cloud::core
