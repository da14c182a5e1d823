// Limits how much of a simulator's output is read, and how much of that is passed on.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

namespace webots_cloud::core {

/// Keeps a simulator that prints without end from occupying the event loop and the logs: lines beyond the
/// budget are dropped and counted, and bytes beyond it stay in the pipe for a while, so that the simulator
/// has to wait.
class OutputBudget
{
public:
    static constexpr double lines_a_second = 500;
    static constexpr double lines_at_once = 2000;
    static constexpr double bytes_a_second = 1e6;
    static constexpr double bytes_at_once = 4e6;
    static constexpr double heartbeats_a_second = 2;
    static constexpr double heartbeats_at_once = 20;

    OutputBudget() = default;

    /// Whether one more line may be passed on; otherwise it is counted.
    bool take_line(TimePoint now);

    /// Whether one more heartbeat may be passed on. The others are dropped without being counted.
    bool take_heartbeat(TimePoint now) { return heartbeats_.take(1, now); }

    /// `bytes` were read.   Returns: when to read again, which may be now.
    TimePoint read(std::size_t bytes, TimePoint now);

    /// When to report that lines were left out: soon after the first, then once a minute; `max()`:
    /// there is nothing to report.
    TimePoint notice_due() const noexcept { return notice_due_; }

    /// The report; nothing when no line was left out since the last time.
    std::optional<std::string> take_notice(TimePoint now);

private:
    /// A token bucket of `max` tokens.
    class Allowance
    {
    public:
        Allowance(double max, double a_second) : max_(max), a_second_(a_second), left_(max) {}

        bool take(double amount, TimePoint now);
        /// May go below zero.
        void spend(double amount, TimePoint now);
        /// When it is not below zero.
        TimePoint recovered(TimePoint now) const;

    private:
        void fill(TimePoint now);

        double max_;
        double a_second_;
        double left_;
        TimePoint filled_;
    };

    Allowance lines_{lines_at_once, lines_a_second};
    Allowance bytes_{bytes_at_once, bytes_a_second};
    Allowance heartbeats_{heartbeats_at_once, heartbeats_a_second};
    std::uint64_t left_out_ = 0; ///< Lines, since the last notice.
    std::optional<TimePoint> last_notice_;
    TimePoint notice_due_ = TimePoint::max();
};

} // namespace webots_cloud::core
