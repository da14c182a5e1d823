// Regressions that learn from small samples what a session costs, how many browsers never come, and what
// other session servers send. The constants were found by simulation: docs/scheduling.md.
#include "placement_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace webots_cloud::placement {

namespace {

constexpr double high_pass = 120; // s
constexpr double memory = 3600;   // s
// In sessions² s; one that comes and stays leaves high_pass / 2 = 60 of them.
constexpr double fleet_strength = 60;
constexpr double min_strength = 10;
constexpr double max_strength = 300;
constexpr double variety = 30; // sessions² s: what one session more or less is worth, as sessions differ
constexpr double enough_to_disagree = 120;
constexpr double max_at_once =
    5 * 64 * 64; // that of 64 sessions that come at once: no report has more weight

constexpr int few = 4;                // sessions
constexpr double other_load = 5;      // percent
constexpr double whole_strength = 10; // s
constexpr double min_cost = 0.1;      // percent
constexpr double max_step = 30;       // s: a longer silence is no evidence of what happened in it
// The load does not show that unclaimed placements came where it rose by less than this part of what they
// were expected to add, or by so few percent; and of fewer than half a session it shows nothing.
constexpr double trace = 1.0 / 4;
constexpr double noise = 1.5;
constexpr double min_expected = 0.5;

constexpr double max_surprise = 16;   // a single odd session must not outweigh all others
constexpr double variety_memory = 50; // sessions

constexpr double traffic_memory = 30; // s
constexpr auto others_memory = std::chrono::hours(24);
constexpr double travel = 1; // s, from our answer to the browser's arrival on the machine

constexpr double show_prior = 10; // browsers assumed to have come, so that the first no-show proves nothing
constexpr double show_memory = 1000;  // browsers
constexpr std::size_t unreported = 2; // eighths: the browser's way, and a poll

} // namespace

void FleetCost::learn(Evidence const& sample, Evidence const& own, TimePoint now) noexcept
{
    double const fade = memory / (memory + std::max(0.0, Seconds(now - last_).count()));
    last_ = now;
    double const part = std::min(1.0, max_at_once / std::max(sample.xx, 1.0));
    sum_.xx = sum_.xx * fade + part * sample.xx;
    sum_.xy = sum_.xy * fade + part * sample.xy;
    ratio_ = std::clamp((fleet_strength + sum_.xy) / (fleet_strength + sum_.xx), 0.01, 100.0);
    if (own.xx < enough_to_disagree)
        return;
    double const difference = std::clamp(own.xy / own.xx / ratio_ - 1, -1.0, 3.0);
    disagreement_ += (difference * difference - disagreement_) / 100;
    strength_ = std::clamp(variety / disagreement_, min_strength, max_strength);
}

bool FleetCost::is_taught() const noexcept
{
    return sum_.xx >= fleet_strength;
}

Evidence SessionCost::learn(double load, double sessions, Seconds since_last, bool settled,
                            Doubt doubt) noexcept
{
    double const step = since_last.count();
    // The first report, or one after a silence: the filters begin where things are now, and nothing is
    // learned.
    if (!primed_ || step <= 0 || step > max_step) {
        slow_load_ = load - mean_y_;
        slow_sessions_ = sessions - mean_x_;
        slow_unclaimed_ = doubt.unclaimed;
        primed_ = true;
        return {};
    }
    // Only changes count: what else runs on the machine stays in the slow parts, and so drops out.
    double const share = step / (high_pass + step);
    slow_load_ += share * (load - slow_load_);
    slow_sessions_ += share * (sessions - slow_sessions_);
    slow_unclaimed_ += share * (doubt.unclaimed - slow_unclaimed_);
    // Old evidence fades, also while nothing new is learned.
    double const fade = memory / (memory + step);
    sum_.xx *= fade;
    sum_.xy *= fade;
    // The load lags behind sessions that have just come or gone.
    if (!settled)
        return {};

    double const claimed = sessions - slow_sessions_ - mean_x_;
    double const expected = doubt.unclaimed - slow_unclaimed_;
    double const dy = load - slow_load_ - mean_y_;
    double const limit = 2 * value_;
    bool const shown =
        expected >= min_expected && dy >= std::max(noise, trace * value_ * (claimed + expected));
    double const dx = claimed + (shown ? expected : 0);
    shown_ = shown_ || shown;
    // The load has fallen by much more than a session's worth, and nobody has left: something else has ended
    // there.
    if (doubt.no_departures && dy < std::min(0.0, value_ * dx - limit))
        return {};
    weight_ = weight_ * fade + step;
    // What lies far from the expectation counts as two sessions' worth away from it: one odd report must not
    // decide.
    double const robust = value_ * dx + std::clamp(dy - value_ * dx, -limit, limit);
    mean_x_ += dx * step / weight_;
    mean_y_ += dy * step / weight_;
    // Welford's update with weights: one factor before and one after the means moved.
    double const rest = step * (1 - step / weight_);
    sum_.xx += rest * dx * dx;
    sum_.xy += rest * dx * robust;
    // In parts of the assumed cost, in which machines of all sizes compare.
    return assumed_ > 0 ? Evidence{rest * dx * dx, rest * dx * robust / assumed_} : Evidence{};
}

void SessionCost::claim(double part) noexcept
{
    slow_sessions_ += part * slow_unclaimed_;
    slow_unclaimed_ -= part * slow_unclaimed_;
}

void SessionCost::weigh(double load, int sessions, double units) noexcept
{
    whole_ = {};
    if (sessions <= few || units <= few)
        return; // changes of the load are better evidence
    // Other load is some 5 percent, so load / n errs by 5 / n: weight n², less where a session costs less
    // than that.
    double const each = load / units;
    double const clear = std::min(1.0, each / other_load);
    double const many = (units - few) * clear;
    whole_.xx = whole_strength * many * many;
    whole_.xy = whole_.xx * std::max(0.0, load - other_load) / units;
}

void SessionCost::combine(double ratio, double strength, double least) noexcept
{
    double const slope =
        (strength * assumed_ * ratio + sum_.xy + whole_.xy) / (strength + sum_.xx + whole_.xx);
    value_ = std::clamp(std::max(slope, least), std::min(min_cost, assumed_), 100.0);
}

void SessionVariety::record(double square) noexcept
{
    square_ += (std::min(square, max_surprise) - square_) / variety_memory;
    value_ = std::sqrt(square_);
}

void ShowRate::record(AgeCounts const& came, std::uint32_t never_came) noexcept
{
    double total = 0;
    for (std::size_t age = 0; age != age_count; ++age) {
        came_[age] += came[age];
        total += came_[age];
    }
    never_came_ += never_came;
    total += never_came_;
    double const fade = total > show_memory ? 0.5 : 1;
    never_came_ *= fade;
    double later = show_prior;
    for (std::size_t age = age_count; age-- != 0;) {
        came_[age] *= fade;
        later += came_[age];
        rate_[age] = std::max(later / (later + never_came_), age < unreported ? min_ : 0);
    }
}

double ShowRate::expected(AgeCounts const& unseen) const noexcept
{
    return std::inner_product(unseen.begin(), unseen.end(), rate_.begin(), 0.0);
}

void ForeignTraffic::record(std::uint32_t arrivals, Seconds report_interval, TimePoint now) noexcept
{
    double const step = std::max(0.0, Seconds(now - last_).count());
    last_ = now;
    per_second_ *= traffic_memory / (traffic_memory + step);
    per_second_ += arrivals / traffic_memory;
    if (arrivals != 0)
        known_until_ = now + others_memory;
    double const interval = report_interval.count();
    interval_ += (interval_ == 0 ? 1 : 0.01) * (interval - interval_);
    unseen_ = per_second_ * (interval_ / 2 + travel);
}

} // namespace webots_cloud::placement
