#include "wait_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace webots_cloud::core {
namespace {

using namespace std::chrono_literals;
using Seconds = std::chrono::duration<double>;

constexpr double time_constant = 3600;      // s, in which departures fade
constexpr std::size_t least_departures = 5; // before anything is told
// Departures that have faded to less than this say too little about now: some two hours without any.
constexpr double least_weight = 0.5;
constexpr Duration longest = 24h;

/// What is told is rounded, the more coarsely the longer it is.
struct Step
{
    Duration below;
    Duration step;
};
constexpr std::array steps = {Step{1min, 5s}, Step{5min, 30s}, Step{15min, 1min},
                              Step{1h, 5min}, Step{4h, 15min}, Step{Duration::max(), 1h}};

Duration step_at(Duration time)
{
    return std::find_if(steps.begin(), steps.end(), [time](Step const& one) { return time < one.below; })
        ->step;
}

Duration rounded_down(Duration time)
{
    auto const step = step_at(time);
    return time / step * step;
}

Duration rounded_up(Duration time)
{
    auto const step = step_at(time);
    return (time + step - Duration(1)) / step * step;
}

Duration duration_of(double seconds)
{
    auto const most = Seconds(longest).count();
    return std::chrono::duration_cast<Duration>(Seconds(std::min(seconds, most)));
}

/// A quantile of the ratio of two Gamma variates, each divided by its shape (Fisher's F with twice the shapes
/// as degrees of freedom), by the approximation of Paulson (1942): the cube roots are almost normal.
/// `deviations`: the same quantile of the normal distribution, at most 1.3 from 0; both shapes at least 1.
/// What lies below differs from what should by less than 0.7 %, of all. Everybody in a long line is told a
/// range every few seconds, and the exact quantile takes a hundred times as long.
double ratio_quantile(double upper_shape, double lower_shape, double deviations)
{
    auto const a = 1 / (9 * upper_shape);
    auto const b = 1 / (9 * lower_shape);
    auto const z = deviations;
    auto const root = std::sqrt((1 - a) * (1 - a) * b + (1 - b) * (1 - b) * a - a * b * z * z);
    return std::pow(((1 - a) * (1 - b) + z * root) / ((1 - b) * (1 - b) - b * z * z), 3);
}

constexpr double ninety_percent = 1.2815515655446004; // of the normal distribution lie below

} // namespace

WaitRange rounded(WaitRange range)
{
    auto const most = std::clamp<Duration>(range.most, 5s, longest);
    return {rounded_down(std::clamp<Duration>(range.least, 0s, most)), rounded_up(most)};
}

std::optional<WaitRange> WaitTold::tell(std::size_t ahead, std::optional<WaitRange> estimate, TimePoint now)
{
    bool const is_over = latest_ <= now;
    // What somebody was told holds until the line in front grows, or has moved on after the time was over.
    if (ahead > ahead_ || (ahead < ahead_ && is_over))
        forget();
    else if (is_over)
        return std::nullopt;
    ahead_ = ahead;
    if (!estimate)
        return std::nullopt;
    auto const range = rounded(*estimate); // as people have read it
    if (latest_ == TimePoint::max())
        earliest_ = TimePoint::max();
    earliest_ = std::min(earliest_, now + range.least);
    latest_ = std::min(latest_, now + range.most);
    return WaitRange{std::max(earliest_ - now, Duration::zero()), latest_ - now};
}

void WaitEstimate::session_began(TimePoint now)
{
    seen_ = seen_at(now);
    updated_ = now;
    ++running_;
}

void WaitEstimate::session_ended(TimePoint now)
{
    if (running_ == 0)
        return;
    seen_ = seen_at(now);
    updated_ = now;
    --running_;
    ++total_departures_;
    seen_.departures += 1;
    seen_.squares += 1;
}

std::optional<WaitRange> WaitEstimate::expect(std::size_t ahead, TimePoint now) const
{
    if (total_departures_ < least_departures || running_ == 0)
        return std::nullopt;
    auto const seen = seen_at(now);
    if (seen.departures < least_weight)
        return std::nullopt;
    // So many departures of full weight would say as much as those that have faded (Kish's effective size).
    auto const worth = seen.departures * seen.departures / seen.squares;
    // The mean time from one end to the next, if as many run as do now.
    auto const between = seen.exposure / seen.departures / static_cast<double>(running_);
    auto const awaited = static_cast<double>(ahead) + 1;
    auto const at = [&](double deviations) {
        return duration_of(awaited * between * ratio_quantile(awaited, worth, deviations));
    };
    return WaitRange{at(-ninety_percent), at(ninety_percent)};
}

WaitEstimate::Seen WaitEstimate::seen_at(TimePoint now) const
{
    auto const kept = std::exp(-Seconds(now - updated_).count() / time_constant);
    auto seen = seen_;
    seen.exposure = seen.exposure * kept + static_cast<double>(running_) * time_constant * (1 - kept);
    seen.departures *= kept;
    seen.squares *= kept * kept;
    return seen;
}

} // namespace webots_cloud::core
