// Estimates learned from the fleet's reports: the cost of a session, the share of no-shows, and the traffic
// of other session servers.
#pragma once

#include "placement_reservations.hpp"

#include <webots_cloud/time.hpp>

namespace webots_cloud::placement {

using Seconds = std::chrono::duration<double>;

/// What the slope of a regression is made of: sums of squares and of products.
struct Evidence
{
    double xx = 0;
    double xy = 0;
};

/// How much a session costs on the machines of a fleet, relative to what each was assumed to cost there, and
/// how far single machines may be expected to differ from that.
///
/// All machines have sessions of the same users, so the evidence of one helps all: a class reveals the cost
/// of its sessions before any machine has a second one. The prior of a machine is empirical Bayes: the more
/// the machines disagree, the less the fleet's estimate weighs against a machine's own evidence.
class FleetCost
{
public:
    double ratio() const noexcept { return ratio_; }
    /// How much evidence (in its `xx`) of a machine's own outweighs the fleet's estimate.
    double strength() const noexcept { return strength_; }
    /// Sessions were seen to come or go: the ratio is more than what was assumed.
    bool is_taught() const noexcept;

    /// `sample`: new evidence of one machine; `own`: all of it.
    void learn(Evidence const& sample, Evidence const& own, TimePoint now) noexcept;

private:
    Evidence sum_;
    double ratio_ = 1;
    double disagreement_ = 0.1; ///< Mean square of what machines' own slopes differ by, relatively.
    double strength_ = 300;
    TimePoint last_{};
};

/// The uncertainty about the sessions of a sample.
struct Doubt
{
    double unclaimed = 0;       ///< Unclaimed placements: up to this many more sessions may be there.
    bool no_departures = false; ///< None is known to have left of late, so none explains a fall.
};

/// How much one session moves one machine's load (or memory), in percent.
///
/// The slope of load against number of sessions, both passed through the same high-pass (2 minutes), so that
/// a session moves both in one shape whatever the machine carries besides; least squares with forgetting (1
/// hour). Residuals are clipped at two sessions: a compiler that runs for a minute has little influence.
/// Where the number of sessions is known and large, the load itself is better evidence than its changes:
/// other work of the machine is then a small part of it.
///
/// Placements without a trace in the load count as no-shows, not as sessions that cost nothing; and a fall of
/// the load that no departure explains counts as the end of other work on the machine.
class SessionCost
{
public:
    explicit SessionCost(double assumed) noexcept : assumed_(assumed), value_(assumed) {}

    double value() const noexcept { return value_; }

    /// `sessions`: how many are visible in `load`, up to a constant. `settled`: for as long as `load` looks
    /// back; samples that are not only pass through the filters. Returns the new evidence, relative to what
    /// was assumed.
    Evidence learn(double load, double sessions, Seconds since_last, bool settled, Doubt doubt = {}) noexcept;
    /// All evidence of changes, relative to what was assumed.
    Evidence evidence() const noexcept { return {sum_.xx, assumed_ > 0 ? sum_.xy / assumed_ : 0}; }
    /// What the load itself says, where `sessions` is all there are, which want as much as `units` average
    /// ones.
    void weigh(double load, int sessions, double units) noexcept;
    /// Since the last call, the load has shown that unclaimed placements did arrive: they cost less
    /// than was expected.
    bool has_shown_unclaimed() noexcept { return std::exchange(shown_, false); }
    /// Combines this machine's evidence with a prior, the fleet's estimate. `least`: percent, what its
    /// simulations are known to cost it.
    void combine(double ratio, double strength, double least = 0) noexcept;
    /// This part of the unclaimed placements was claimed.
    void claim(double part) noexcept;
    /// This part of them never came: they leave no trace in the filters.
    void forget(double part) noexcept { slow_unclaimed_ -= part * slow_unclaimed_; }
    /// Starts anew from the next sample, keeping what was learned.
    void interrupt() noexcept { primed_ = false; }

private:
    double assumed_;
    double value_;
    double slow_load_ = 0;
    double slow_sessions_ = 0;
    double slow_unclaimed_ = 0; ///< Not among `slow_sessions_`.
    double mean_x_ = 0;
    double mean_y_ = 0;
    double weight_ = 0;
    Evidence sum_;
    Evidence whole_;
    bool primed_ = false;
    bool shown_ = false;
};

/// How different sessions are: the standard deviation of their cost, relative to its mean.
class SessionVariety
{
public:
    double value() const noexcept { return value_; }
    /// The square of how far one session differed from the mean, relatively.
    void record(double square) noexcept;

private:
    double square_ = 0.25;
    double value_ = 0.5;
};

/// The probability that a browser arrives at all that has not been seen for so long: an actuarial estimate.
///
/// Of all whose fate is known and who were unseen at that age, the part that came later. Without no-shows
/// that is 1, and a reservation counts in full until it is confirmed or expires; where three of ten browsers
/// never come, a reservation counts 0.7 at first, and almost nothing once the others should have arrived.
///
/// However many never came, a reservation that no report can have shown yet counts `min`: otherwise
/// unclaimed requests would send the next class to one machine.
class ShowRate
{
public:
    explicit ShowRate(double min) noexcept : min_(min) {}

    void record(AgeCounts const& came, std::uint32_t never_came) noexcept;
    /// How many of these reservations will still turn into sessions.
    double expected(AgeCounts const& unseen) const noexcept;

private:
    std::array<double, age_count> came_{};
    double never_came_ = 0;
    double min_;
    std::array<double, age_count> rate_ = filled_with_one();

    static std::array<double, age_count> filled_with_one() noexcept
    {
        std::array<double, age_count> ones{};
        ones.fill(1);
        return ones;
    }
};

/// How many sessions other session servers place on the same machines unseen.
///
/// Arrivals that machines report and we did not place, per second, times how long an arrival stays unseen
/// (half a report interval, and a second for the browser's way).
class ForeignTraffic
{
public:
    void record(std::uint32_t arrivals, Seconds report_interval, TimePoint now) noexcept;
    double unseen() const noexcept { return unseen_; }
    /// Others have placed sessions within a day.
    bool is_known(TimePoint now) const noexcept { return now < known_until_; }

private:
    TimePoint last_{};
    TimePoint known_until_ = TimePoint::min();
    double per_second_ = 0;
    double interval_ = 0;
    double unseen_ = 0;
};

} // namespace webots_cloud::placement
