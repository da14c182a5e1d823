#include "simulator_state.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

std::string minutes_text(Duration time)
{
    return std::to_string(std::chrono::round<std::chrono::minutes>(time).count());
}

} // namespace

void SimulatorState::start_goes_on(TimePoint now)
{
    ready_by_ = std::min(now + start_timeout_, ends_at_);
}

bool SimulatorState::begins(TimePoint now)
{
    if (!std::exchange(waits_, false))
        return false;
    ends_at_ = now + timeout_;
    start_goes_on(now);
    return true;
}

SimulatorState::Heartbeat SimulatorState::heartbeat(TimePoint now)
{
    if (state_ == State::loading) {
        state_ = State::opening;
        if (!is_told_)
            first_look_ = next_look_ = now;
        return Heartbeat::world_is_loaded;
    }
    return was_ready_ ? Heartbeat::pass_on : Heartbeat::ignore;
}

void SimulatorState::looked_for_port(TimePoint now)
{
    next_look_ = now + std::clamp<Duration>((now - first_look_) / 8, shortest_pause, longest_pause);
}

bool SimulatorState::port_opened()
{
    if (state_ != State::opening)
        return false;
    state_ = State::ready;
    was_ready_ = true;
    return true;
}

bool SimulatorState::activity(bool running)
{
    if (!was_ready_)
        early_activity_ = running;
    return was_ready_;
}

bool SimulatorState::take_restart()
{
    bool const stops = state_ == State::stopping || state_ == State::ended;
    return !stops && std::exchange(restart_wanted_, false);
}

Duration SimulatorState::extend(Duration asked) noexcept
{
    auto const granted = std::clamp(asked, Duration::zero(), extendable());
    extendable_ -= granted;
    timeout_ += granted;
    ends_at_ += granted;
    return granted;
}

Duration SimulatorState::extendable() const noexcept
{
    return state_ == State::stopping || state_ == State::ended ? Duration::zero() : extendable_;
}

bool SimulatorState::stop(Failure reason) noexcept
{
    if (state_ == State::stopping || state_ == State::ended)
        return false;
    state_ = State::stopping;
    stop_reason_ = std::move(reason);
    return true;
}

Failure SimulatorState::end_reason(std::string_view how, bool expected, std::string_view last_words) const
{
    if (state_ == State::stopping)
        return stop_reason_;
    if (!was_ready_ && last_words.empty())
        return refused(Refused::ended_early, {{"how", how}});
    if (!was_ready_)
        return refused(Refused::ended_early_saying, {{"how", how}, {"words", printable(last_words, 200)}});
    return expected ? refused(Refused::quit) : refused(Refused::crashed, {{"how", how}});
}

TimePoint SimulatorState::deadline() const noexcept
{
    if (is_waiting())
        return TimePoint::max();
    switch (state_) {
    case State::loading:
        return ready_by_;
    case State::opening:
        return std::min(ready_by_, next_look_);
    case State::ready:
        return ends_at_;
    default:
        return TimePoint::max();
    }
}

SimulatorState::Due SimulatorState::due(TimePoint now) const noexcept
{
    if (state_ == State::stopping || state_ == State::ended || is_waiting())
        return Due::nothing;
    if (now >= ends_at_)
        return Due::stop_at_time_limit;
    if (state_ == State::ready)
        return Due::nothing;
    if (now >= ready_by_)
        return state_ == State::opening ? Due::stop_without_port : Due::stop_unloaded;
    return state_ == State::opening && now >= next_look_ ? Due::look_for_port : Due::nothing;
}

Failure SimulatorState::stop_reason(Due due) const
{
    if (due == Due::stop_at_time_limit)
        return refused(Refused::time_limit,
                       {{"seconds", seconds_text(timeout_)}, {"minutes", minutes_text(timeout_)}});
    return refused(due == Due::stop_without_port ? Refused::no_port : Refused::not_loaded,
                   {{"seconds", seconds_text(start_timeout_)}});
}

} // namespace webots_cloud::core
