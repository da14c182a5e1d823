#include "notice_queue.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

/// `first` doubled after each failure in a row but the first, up to `longest`.
Duration delay_after(int failures, Duration first, Duration longest)
{
    auto delay = std::min(first, longest);
    for (int i = 1; i < failures && delay < longest; ++i)
        delay = std::min(2 * delay, longest);
    return delay;
}

} // namespace

std::optional<Notice> NoticeQueue::push(Notice notice)
{
    waiting_.push_back(std::move(notice));
    if (waiting_.size() <= rule_.longest)
        return std::nullopt;
    return pop();
}

std::optional<TimePoint> NoticeQueue::due() const noexcept
{
    return waiting_.empty() ? std::nullopt : std::optional(next_);
}

NoticeQueue::Attempt NoticeQueue::attempt() const
{
    Attempt attempt;
    attempt.number = first_;
    attempt.notice = waiting_.front();
    return attempt;
}

void NoticeQueue::delivered(Attempt const& attempt)
{
    failures_ = 0;
    next_ = TimePoint::min();
    if (attempt.number == first_)
        pop();
}

std::optional<Notice> NoticeQueue::failed(Attempt const& attempt, Failure const& failure, TimePoint now)
{
    ++failures_;
    next_ = now + delay_after(failures_, rule_.first_delay, rule_.max_delay);
    if (attempt.number != first_)
        return std::nullopt; // it was dropped meanwhile
    refusals_ = failure == errc::refused ? refusals_ + 1 : 0;
    if (refusals_ < rule_.max_refusals)
        return std::nullopt;
    return pop();
}

void NoticeQueue::retry() noexcept
{
    failures_ = refusals_ = 0;
    next_ = TimePoint::min();
}

std::deque<Notice> NoticeQueue::clear()
{
    std::deque<Notice> all;
    while (!empty())
        all.push_back(pop());
    return all;
}

Notice NoticeQueue::pop()
{
    auto notice = std::move(waiting_.front());
    waiting_.pop_front();
    ++first_;
    refusals_ = 0;
    return notice;
}

} // namespace webots_cloud::core
