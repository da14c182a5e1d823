// One simulation's life, from its browser's request to the end of its cleaning up: what happens, and what is
// to be done next.
#pragma once

#include <webots_cloud/time.hpp>

namespace webots_cloud::core {

/// A state machine without a clock: its owner reports what happens, and when, and does what it is told.
///
/// Whoever talks with the browser is a conversation. A simulation has one at a time; a browser that returns
/// opens another, which takes over from the one before.
class SimulationLife
{
public:
    enum class State
    {
        fetching,     ///< The project, once the simulation is admitted.
        launching,    ///< Until the world is loaded.
        serving,      ///< A browser, since the world is loaded.
        waiting,      ///< For its browser to return.
        handing_over, ///< Another conversation takes over: the one that has the simulation must end.
        exited,       ///< The simulator has ended without being asked to.
        ending,       ///< The simulator is ended, and what is left is removed.
        ended         ///< Nothing is left.
    };

    /// How far it has come, for pages and figures. It stays as it is while the simulation waits and ends.
    enum class Stage
    {
        fetching,
        launching,
        idle,
        running
    };

    /// What the operator is to be told of the browser.
    enum class Loss
    {
        none,
        awaited,     ///< Its connection broke; it may return.
        not_ready,   ///< Its connection broke too early for a return.
        not_awaited, ///< Its connection broke, and no browser is ever waited for.
        not_returned ///< In time.
    };

    enum class Action
    {
        await_return, ///< Wait until `until`, or until something else happens: that is a conversation too.
        hand_over,    ///< Let the conversation that takes over go on.
        clean_up      ///< End the simulator and remove what is left.
    };

    struct Next
    {
        Action action = Action::clean_up;
        Loss loss = Loss::none;
        TimePoint until;        ///< With `await_return`.
        bool abandoned = false; ///< With `clean_up`: the browser left before the start was over.
        bool exited = false;    ///< With `clean_up`: there is no simulator to end any more.
    };

    /// `reconnect_grace`: how long a browser that lost its connection is waited for; 0: not at all.
    /// `server_is_stopping`: before the simulation began.
    SimulationLife(Duration reconnect_grace, TimePoint now, bool server_is_stopping = false)
        : grace_(reconnect_grace), stage_began_(now), stopping_(server_is_stopping)
    {}

    /// The project is there. How long that took.
    Duration fetched(TimePoint now);

    /// The simulator runs, until `ends_at` at the latest. How long its launch took.
    Duration launched(TimePoint now, TimePoint ends_at);

    /// The world is loaded. How long that took.
    Duration ready(TimePoint now);

    /// The start failed. False: its outcome was known before.
    bool failed();

    /// The simulation runs, or is paused.
    void activity(bool running) { stage_ = running ? Stage::running : Stage::idle; }

    /// The simulator has ended without being asked to.
    void exited() { state_ = State::exited; }

    /// The browser closed its connection, or lost it.
    void browser_left(bool lost) { lost_ = lost; }

    /// A browser returned. True: the conversation that has the simulation must end, and then says whether the
    /// returned one may go on.
    bool take_over();

    /// Nobody is waited for any more. True: the browser is to be told that its simulation will not start.
    bool server_stops();

    /// The conversation is over: the browser has left, the simulator has exited, another conversation takes
    /// over, or the wait for a browser ended.
    Next conversation_ended(TimePoint now);

    void cleaned_up() { state_ = State::ended; }

    State state() const noexcept { return state_; }
    Stage stage() const noexcept { return stage_; }

    /// A browser that returned can't go on with it any more.
    bool is_over() const noexcept { return state_ == State::ending || state_ == State::ended; }

    /// Browsers get a word by which they can return.
    bool has_grace() const noexcept { return grace_ > Duration::zero(); }

    /// The conversation is to end although nothing happened to its browser.
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
    bool lost_ = false; ///< The last browser, without a word.
    bool stopping_;     ///< The server.
};

} // namespace webots_cloud::core
