// Notices that wait to be delivered, and when to try: a mail server that is down is asked less and less
// often.
//
// The rule. Notices go out in order. After a failed attempt the next one is 15 s later, and each further
// failure in a row doubles that, up to 15 min. A notice that was refused six times in a row is given up, so
// that it does not stop those behind it; other failures are the mail server's own, and are waited out. Beyond
// 50 notices the oldest is dropped.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/notice.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <deque>
#include <optional>

namespace webots_cloud::core {

struct RetryRule
{
    RetryRule() = default;

    Duration first_delay = std::chrono::seconds(15);
    Duration max_delay = std::chrono::minutes(15);
    int max_refusals = 6;     ///< Attempts at a notice that end with `refused`, before it is given up.
    std::size_t longest = 50; ///< Notices in the queue.
};

/// One attempt is under way at a time: between `due` and `delivered` or `failed` the front stays the front,
/// unless it is dropped. Thus `attempt` hands out a copy, and what happened is told with its number.
class NoticeQueue
{
public:
    /// An attempt to deliver the oldest notice.
    struct Attempt
    {
        Attempt() = default;

        std::size_t number = 0; ///< Of the notice, counted from the first one ever.
        Notice notice;
    };

    explicit NoticeQueue(RetryRule rule = {}) : rule_(rule) {}

    /// Takes a notice in. What it returns was dropped for it.
    std::optional<Notice> push(Notice notice);

    /// When the oldest notice is to be delivered, possibly long ago; nothing while the queue is empty.
    std::optional<TimePoint> due() const noexcept;

    /// Precondition: not empty.
    Attempt attempt() const;

    /// The attempt succeeded.
    void delivered(Attempt const& attempt);

    /// The attempt failed. What it returns was given up.
    std::optional<Notice> failed(Attempt const& attempt, Failure const& failure, TimePoint now);

    /// Forgets the failures: the next attempt is due at once.
    void retry() noexcept;

    /// Takes all of them out, oldest first.
    std::deque<Notice> clear();

    bool empty() const noexcept { return waiting_.empty(); }

    /// All of them, oldest first.
    std::deque<Notice> const& waiting() const noexcept { return waiting_; }

private:
    Notice pop();

    RetryRule rule_;
    std::deque<Notice> waiting_;
    std::size_t first_ = 0; ///< The number of the oldest.
    int failures_ = 0;      ///< Of all attempts in a row.
    int refusals_ = 0;      ///< Of the oldest notice, in a row.
    TimePoint next_ = TimePoint::min();
};

} // namespace webots_cloud::core
