// How long the next in line will wait, from the lengths of sessions.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <optional>

namespace webots_cloud::core {

struct WaitRange
{
    Duration least{};
    Duration most{};

    bool operator==(WaitRange const&) const = default;
};

/// As people say it: in steps of 5 s below a minute, of half a minute below 5 minutes, of a minute below 15,
/// of 5 minutes below an hour, of a quarter of an hour below 4 hours, of an hour above, and at most a day.
/// `least` down and `most` up, so that what is said holds at least as often as what was computed. `least` may
/// become 0, `most` is at least 5 s.
WaitRange rounded(WaitRange range);

/// What somebody who waits was told, so that it is never taken back while the place stays: the longer nobody
/// leaves, the rarer departures seem, so that an estimate that is made anew grows all the time.
class WaitTold
{
public:
    /// What may be told now: the part that is left of the shortest range so far. Nothing where that is over,
    /// as nobody knows then. A better place after that, or a worse one, begins anew.
    std::optional<WaitRange> tell(std::size_t ahead, std::optional<WaitRange> estimate, TimePoint now);

    /// That one waits for something else now.
    void forget() noexcept { latest_ = TimePoint::max(); }

    std::size_t ahead() const noexcept { return ahead_; }

private:
    std::size_t ahead_ = 0;
    TimePoint earliest_ = TimePoint::max();
    TimePoint latest_ = TimePoint::max(); ///< The end of the range; the maximum: there is none.
};

/// Expects that sessions end as if each had the same chance to end in the next second, however long it has
/// lasted: exponential lengths. The rate is the number of departures divided by the time that all sessions
/// together have lasted, those that still run included (the estimate of greatest likelihood from censored
/// lengths). Both fade with a time constant of an hour, so that it follows the day.
///
/// While somebody waits, every seat that comes free is taken at once. So as many sessions go on running as do
/// now, and the wait is the time until as many have ended as are ahead, and one more: a Gamma distribution,
/// if the rate were known. It is only estimated, and the range takes that into account: it is one of the
/// ratio of two Gamma variates (Fisher's F), which comes close to the Gamma distribution with the number of
/// departures seen, and without which a wait after few departures would be outside of the range too often.
///
/// Where sessions do not end like that, such as when a lesson is over, nor does the range hold.
class WaitEstimate
{
public:
    /// `now` never goes back, from one call to the next.
    void session_began(TimePoint now);
    void session_ended(TimePoint now);

    /// Sessions that run.
    std::size_t running() const noexcept { return running_; }

    /// From the 10 % to the 90 % quantile of the wait of somebody who has `ahead` others before: four of five
    /// wait that long, one in ten less, one in ten more. None before 5 departures, while nothing runs, and
    /// when there have been next to no departures for hours.
    std::optional<WaitRange> expect(std::size_t ahead, TimePoint now) const;

private:
    struct Seen
    {
        double exposure = 0;   // seconds that sessions have lasted
        double departures = 0; // how many have ended
        double squares = 0;    // of their weights: departures² / squares is how many they are worth
    };

    Seen seen_at(TimePoint now) const;

    Seen seen_;
    TimePoint updated_;
    std::size_t running_ = 0;
    std::size_t total_departures_ = 0;
};

} // namespace webots_cloud::core
