#include "simulation_life.hpp"

#include <utility>

namespace webots_cloud::core {

Duration SimulationLife::end_stage(TimePoint now)
{
    return now - std::exchange(stage_began_, now);
}

Duration SimulationLife::fetched(TimePoint now)
{
    state_ = State::launching;
    stage_ = Stage::launching;
    return end_stage(now);
}

Duration SimulationLife::launched(TimePoint now, TimePoint ends_at)
{
    ends_at_ = ends_at;
    return end_stage(now);
}

bool SimulationLife::take_staged(Duration reconnect_grace)
{
    if (!staged_ || state_ != State::waiting || must_let_go())
        return false;
    grace_ = reconnect_grace;
    staged_ = false;
    state_ = State::handing_over;
    return true;
}

bool SimulationLife::give_back()
{
    given_back_ = staged_;
    return staged_;
}

Duration SimulationLife::ready(TimePoint now)
{
    state_ = staged_ ? State::waiting : State::serving;
    stage_ = Stage::idle;
    start_ = Start::succeeded;
    return end_stage(now);
}

bool SimulationLife::failed()
{
    return std::exchange(start_, Start::failed) == Start::under_way;
}

bool SimulationLife::take_over()
{
    // Before the world is loaded no browser can return: it has no token yet.
    bool const possible =
        has_grace() && !ended_by_operator_ && (state_ == State::serving || state_ == State::waiting);
    if (possible)
        state_ = State::handing_over;
    return possible;
}

bool SimulationLife::server_stops()
{
    stopping_ = true;
    return start_ == Start::under_way && (state_ == State::fetching || state_ == State::launching);
}

bool SimulationLife::operator_ends()
{
    if (ended_by_operator_ || state_ == State::exited || is_over())
        return false;
    ended_by_operator_ = true;
    return true;
}

bool SimulationLife::must_let_go() const noexcept
{
    return ended_by_operator_ || given_back_ || state_ == State::handing_over ||
           (stopping_ && (staged_ || state_ == State::waiting));
}

SimulationLife::Next SimulationLife::connection_ended(TimePoint now)
{
    auto const leaving = std::exchange(leaving_, Leaving::for_good);
    bool const lost = leaving == Leaving::lost && !stopping_ && !ended_by_operator_;
    bool const may_return = leaving != Leaving::for_good && !stopping_ && !ended_by_operator_;
    switch (state_) {
    // It was asked to let go of the simulation, which another connection takes over.
    case State::handing_over: {
        state_ = State::serving;
        Next next;
        next.action = Action::hand_over;
        return next;
    }
    // Nobody has come back in time, or the wait was ended.
    case State::waiting:
        return end(stopping_ || ended_by_operator_ || staged_ ? Loss::none : Loss::not_returned);
    case State::serving:
        // A connection that was lost, or a page that is loaded again: the simulation waits for its browser.
        if (may_return && has_grace()) {
            state_ = State::waiting;
            Next next;
            next.action = Action::await_return;
            next.loss = Loss::awaited;
            next.until = now + grace_;
            return next;
        }
        if (leaving == Leaving::for_good && !stopping_ && !ended_by_operator_) {
            auto next = end(Loss::none);
            next.quit = true;
            return next;
        }
        [[fallthrough]];
    case State::fetching:
    case State::launching:
        // Without a token, which comes with the world, no browser can return to it.
        if (lost)
            return end(has_grace() ? Loss::not_ready : Loss::not_awaited);
        [[fallthrough]];
    default:
        return end(Loss::none);
    }
}

SimulationLife::Next SimulationLife::end(Loss loss)
{
    Next next;
    next.exited = state_ == State::exited;
    state_ = State::ending;
    next.loss = loss;
    next.abandoned = start_ == Start::under_way;
    return next;
}

} // namespace webots_cloud::core
