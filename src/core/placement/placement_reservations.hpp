// What was placed on one machine and cannot be seen in its reports yet.
#pragma once

#include <webots_cloud/time.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>

namespace webots_cloud::placement {

/// Ages are told apart in eighths of the placement timeout: 7.5 s of 60 s.
inline constexpr std::size_t age_count = 8;

/// How many reservations there are of each age.
using AgeCounts = std::array<std::uint32_t, age_count>;

/// The part of those of each age whose load a bare number shows, 20 to 40 s after they were placed.
inline constexpr std::array<double, age_count> visible_part = {0, 0, 0.25, 0.6, 0.9, 1, 1, 1};

inline double visible_of(AgeCounts const& counts) noexcept
{
    return std::inner_product(counts.begin(), counts.end(), visible_part.begin(), 0.0);
}

/// The number of the eighth that a moment lies in; all of time is one eighth where the timeout is 0.
class AgeClock
{
public:
    explicit AgeClock(Duration timeout) noexcept
        : width_(timeout.count() / static_cast<Duration::rep>(age_count))
    {}
    std::int64_t eighth(TimePoint now) const noexcept
    {
        return width_ > 0 ? now.time_since_epoch().count() / width_ : 0;
    }
    bool forgets_at_once() const noexcept { return width_ == 0; }

private:
    Duration::rep width_;
};

/// The reservations of one machine by age, in 40 bytes whatever their number: placing never allocates.
///
/// Only reports settle reservations, never the clock alone: between two reports nothing new is known, and a
/// machine without reports is not offered.
class Reservations
{
public:
    std::uint32_t count() const noexcept { return count_; }
    AgeCounts const& by_age() const noexcept { return ages_; }

    /// Adds one in the eighth `now`. Others grow older by that, but none runs out.
    void add(std::int64_t now) noexcept
    {
        AgeCounts aged{};
        std::size_t const steps = steps_until(now);
        for (std::size_t age = 0; age != age_count; ++age)
            aged[std::min(age + steps, age_count - 1)] += ages_[age];
        ages_ = aged;
        ++ages_[0];
        ++count_;
    }

    /// Lets time pass until the eighth `now`; returns how many ran out: those `lifetime` eighths old.
    std::uint32_t age_until(std::int64_t now, std::size_t lifetime = age_count) noexcept
    {
        std::size_t const steps = steps_until(now);
        std::uint32_t expired = 0;
        for (std::size_t age = age_count; age-- != 0;) {
            if (age + steps >= lifetime)
                expired += ages_[age];
            ages_[age] = age >= steps && age < lifetime ? ages_[age - steps] : 0;
        }
        count_ -= expired;
        return expired;
    }

    /// Takes up to `arrived` away, and adds to `confirmed` how many of which age; returns how many in all.
    ///
    /// A browser arrives within a second or two, so a newly counted session is the newest reservation; a load
    /// rises only when the simulator runs, so there the oldest goes first.
    std::uint32_t confirm(std::uint32_t arrived, bool newest_first, AgeCounts& confirmed) noexcept
    {
        std::uint32_t left = std::min(arrived, count_);
        std::uint32_t const taken = left;
        for (std::size_t step = 0; step != age_count && left != 0; ++step) {
            std::size_t const age = newest_first ? step : age_count - 1 - step;
            std::uint32_t const here = std::min(left, ages_[age]);
            ages_[age] -= here;
            confirmed[age] += here;
            left -= here;
        }
        count_ -= taken;
        return taken;
    }

    /// Takes away one that was added in the eighth `added`, or of the next age that has some: arrivals are
    /// not told apart. False when there is none.
    bool take_back(std::int64_t added) noexcept
    {
        constexpr auto last = static_cast<std::int64_t>(age_count) - 1;
        auto const first = static_cast<std::size_t>(std::clamp<std::int64_t>(eighth_ - added, 0, last));
        for (std::size_t step = 0; step != age_count; ++step) {
            std::uint32_t& here = ages_[(first + step) % age_count];
            if (here == 0)
                continue;
            --here;
            --count_;
            return true;
        }
        return false;
    }

    void clear() noexcept
    {
        ages_.fill(0);
        count_ = 0;
    }

private:
    std::size_t steps_until(std::int64_t now) noexcept
    {
        auto const steps = std::clamp<std::int64_t>(now - eighth_, 0, static_cast<std::int64_t>(age_count));
        eighth_ = std::max(eighth_, now);
        return static_cast<std::size_t>(steps);
    }

    std::int64_t eighth_ = 0;
    AgeCounts ages_{};
    std::uint32_t count_ = 0;
};

/// How many sessions were placed on one machine up to some time ago.
///
/// A machine that reports a bare number shows a session some 20 to 40 s after it was placed, so its load is
/// explained by what had been placed then.
class PlacedHistory
{
public:
    void add() noexcept { ++recent_[0]; }

    void age_until(std::int64_t now) noexcept
    {
        for (; eighth_ < now && (recent_ != AgeCounts{}); ++eighth_) {
            older_ += recent_.back();
            std::shift_right(recent_.begin(), recent_.end(), 1);
            recent_.front() = 0;
        }
        eighth_ = std::max(eighth_, now);
    }

    /// Takes back those that never came: their reservations ran out.
    void forget(std::uint32_t expired) noexcept { older_ = std::max(0.0, older_ - expired); }

    /// Takes back one that was added this many eighths ago.
    void take_back(std::size_t age) noexcept
    {
        if (age < age_count && recent_[age] != 0)
            --recent_[age];
    }

    /// Those whose load should be visible: all older than four eighths, part of those of one to four.
    double visible() const noexcept { return older_ + visible_of(recent_); }

private:
    std::int64_t eighth_ = 0;
    AgeCounts recent_{};
    double older_ = 0;
};

} // namespace webots_cloud::placement
