// A simulation's life, from its browser's request to the end of its clean-up: which event leads to what.
#pragma once

#include <webots_cloud/time.hpp>

namespace webots_cloud::core {

/// A state machine without a clock: its owner reports what happens, and when, and carries out what it
/// returns.
///
/// A simulation has one connection to its browser at a time; a browser that returns opens another one, which
/// takes over. While the simulation waits for its browser, that counts as a connection too. A staged
/// simulation waits for its first browser.
class SimulationLife
{
public:
    enum class State
    {
        fetching,     ///< The project, once the simulation is admitted.
        launching,    ///< Until the world is loaded.
        serving,      ///< A browser, since the world is loaded.
        waiting,      ///< For its browser to come, or to return.
        handing_over, ///< Another connection takes over: the one before must end.
        exited,       ///< The simulator has ended by itself.
        ending,       ///< The simulator is being ended, and what is left removed.
        ended         ///< Nothing is left.
    };

    /// What it has reached, for pages and figures. It stays while the simulation waits and ends.
    enum class Stage
    {
        fetching,
        launching,
        idle,
        running
    };

    /// How the simulation lost its browser.
    enum class Loss
    {
        none,
        awaited,     ///< Its connection broke; it may return.
        not_ready,   ///< Its connection broke too early for a return.
        not_awaited, ///< Its connection broke, and there is no grace.
        not_returned ///< It did not return within `reconnectGrace`.
    };

    enum class Action
    {
        await_return, ///< Wait until `until`, or until something else happens.
        hand_over,    ///< Let the connection that takes over go on.
        clean_up      ///< End the simulator and remove what is left.
    };

    struct Next
    {
        Action action = Action::clean_up;
        Loss loss = Loss::none;
        TimePoint until;        ///< With `await_return`.
        bool abandoned = false; ///< With `clean_up`: the browser left before the simulation was ready.
        bool exited = false;    ///< With `clean_up`: the simulator has ended already.
        /// With `clean_up`: the browser has left for good, and so ends its connections to the simulator, too.
        bool quit = false;
    };

    /// `reconnect_grace`: how long to wait for a browser that lost its connection; 0: not at all.
    /// `server_is_stopping`: already when the simulation began.
    SimulationLife(Duration reconnect_grace, TimePoint now, bool server_is_stopping = false)
        : grace_(reconnect_grace), stage_began_(now), stopping_(server_is_stopping)
    {}

    /// It has no browser yet. To be called first.
    void begin_staged() { staged_ = true; }
    bool is_staged() const noexcept { return staged_; }

    /// A browser comes, and takes over as one that returns; from now on it is waited for as long as
    /// `reconnect_grace`.   Returns: false when the simulation is not staged, not ready, or is being ended.
    bool take_staged(Duration reconnect_grace);

    /// The server needs its place for others, or its project is old.   Returns: false when a browser has it.
    bool give_back();

    /// The project has been fetched.   Returns: how long that took.
    Duration fetched(TimePoint now);

    /// The project has been fetched for later starts, and nothing follows.
    void fetched_for_later() { start_ = Start::succeeded; }

    /// The simulator has been started, and runs until `ends_at` at the latest.   Returns: how long that took.
    Duration launched(TimePoint now, TimePoint ends_at);

    /// It runs until then at the latest, since it was extended.
    void extended(TimePoint ends_at) { ends_at_ = ends_at; }

    /// The world is loaded.   Returns: how long that took.
    Duration ready(TimePoint now);

    /// The start failed.   Returns: false when it had succeeded or failed before.
    bool failed();

    /// The simulation runs, or is paused.
    void activity(bool running) { stage_ = running ? Stage::running : Stage::idle; }

    /// The simulator has ended by itself.
    void exited() { state_ = State::exited; }

    /// How a browser leaves.
    enum class Leaving
    {
        for_good,
        page_left, ///< Its page was left or reloaded, or will try another connection: it may return.
        lost       ///< Its connection broke without a close frame.
    };

    void browser_left(Leaving leaving) { leaving_ = leaving; }

    /// A browser returned.   Returns: whether it takes over, once the connection that owns the simulation has
    /// ended.
    bool take_over();

    /// The server stops, and waits for no browser any more.   Returns: whether to tell the browser that its
    /// simulation will not start.
    bool server_stops();

    /// The operator ends the simulation.   Returns: false when it has ended, or is being ended.
    bool operator_ends();
    bool was_ended_by_operator() const noexcept { return ended_by_operator_; }

    /// The connection has ended: the browser has left, the simulator has exited, another connection takes
    /// over, or the wait for the browser has ended.
    Next connection_ended(TimePoint now);

    void cleaned_up() { state_ = State::ended; }

    State state() const noexcept { return state_; }
    Stage stage() const noexcept { return stage_; }

    /// No browser can return to it any more.
    bool is_over() const noexcept { return state_ == State::ending || state_ == State::ended; }

    /// Browsers get a token with which they can return.
    bool has_grace() const noexcept { return grace_ > Duration::zero(); }
    Duration grace() const noexcept { return grace_; }

    /// The connection must end although its browser has not left.
    bool must_let_go() const noexcept;

    /// Before the simulator is ended for its age.
    Duration time_left(TimePoint now) const noexcept { return ends_at_ - now; }

private:
    enum class Start
    {
        under_way,
        succeeded,
        failed
    };

    Duration end_stage(TimePoint now);
    Next end(Loss loss);

    Duration grace_;
    State state_ = State::fetching;
    Stage stage_ = Stage::fetching;
    Start start_ = Start::under_way;
    TimePoint stage_began_;
    TimePoint ends_at_;
    Leaving leaving_ = Leaving::for_good;
    bool stopping_; ///< The server.
    bool ended_by_operator_ = false;
    bool staged_ = false;
    bool given_back_ = false;
};

} // namespace webots_cloud::core
