#include "world_costs.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace webots_cloud::placement {

namespace {

// Minutes of sessions: so much of a world's own outweighs its repository, of a repository the mode, of a mode
// the fleet.
constexpr double own_world = 0.2;
constexpr double own_repository = 30;
constexpr double own_mode = 100;
// More than this is not remembered, so that what changes is learned.
constexpr double most_of_world = 60;
constexpr double most_of_repository = 300;
constexpr double most_of_fleet = 3000;
constexpr double most_at_once = 1;

constexpr double of_one_world = 4; // what differs by a larger factor counts as this
constexpr double of_one_repository = 10;
constexpr double of_any = 50;
constexpr double enough_to_clip = 0.5; // min
constexpr double max_relative = 50;
constexpr double min_relative = 0.02;
constexpr double least_processors = 0.001;
/// No machine outweighs a fleet by the sessions that it claims to have.
constexpr double most_sessions = 64;
/// The relative standard deviation of the sessions of one world.
constexpr double within_world = 0.25;
/// The fraction that a fading estimate loses in a second: a time constant of two weeks.
constexpr double fading = 14 * 86400.0;

} // namespace

WorldCosts::Estimate const* WorldCosts::find(std::uint64_t digest) const noexcept
{
    auto const found = estimates_.find(digest);
    return found == estimates_.end() ? nullptr : &found->second;
}

ExpectedCost WorldCosts::expect(WorldKey const& key) const noexcept
{
    ExpectedCost expected;
    if (fleet_.weight <= 0)
        return expected;
    struct Level
    {
        std::uint64_t digest;
        double own;
    };
    double mean = fleet_.mean;
    double known = 0;
    for (Level const& level :
         {Level{key.mode, own_mode}, Level{key.repository, own_repository}, Level{key.world, own_world}}) {
        Estimate const* const estimate = find(level.digest);
        known = estimate ? estimate->weight / (estimate->weight + level.own) : 0;
        if (estimate)
            mean += known * (estimate->mean - mean);
    }
    expected.mean = std::clamp(mean / fleet_.mean, min_relative, max_relative);
    expected.is_known = known > 0.5;
    double const spread = within_world * expected.mean;
    expected.variance = spread * spread;
    return expected;
}

void WorldCosts::add(Estimate& estimate, double sample, double weight, Memory memory, TimePoint now) noexcept
{
    double const away = std::max(0.0, std::chrono::duration<double>(now - estimate.seen).count());
    estimate.seen = now;
    estimate.weight = std::min(estimate.weight * fading / (fading + away), memory.max_weight);
    if (estimate.weight > enough_to_clip)
        sample = std::clamp(sample, estimate.mean / memory.max_factor, estimate.mean * memory.max_factor);
    estimate.weight += weight;
    estimate.mean += (sample - estimate.mean) * weight / estimate.weight;
}

void WorldCosts::learn(std::uint64_t digest, double sample, double weight, Memory memory, TimePoint now)
{
    Estimate& estimate = estimates_[digest];
    if (estimate.weight == 0)
        estimate.seen = now;
    add(estimate, sample, weight, memory, now);
}

void WorldCosts::learn(std::vector<WorldUse> const& worlds, double processors, Duration since_last,
                       TimePoint now)
{
    double const minutes = std::chrono::duration<double, std::ratio<60>>(since_last).count();
    for (WorldUse const& use : worlds) {
        if (use.running <= 0 || minutes <= 0)
            continue;
        double const each = std::max(std::min(use.processors / use.running, processors), least_processors);
        double const weight = std::min(minutes * use.running, most_at_once);
        if (fleet_.weight == 0)
            fleet_.seen = now;
        double const sessions = use.running;
        // The fleet's mean is over all sessions, so its weights are.
        add(fleet_, each, minutes * std::min(sessions, most_sessions), {most_of_fleet, of_any}, now);
        learn(use.key.mode, each, weight, {most_of_fleet, of_any}, now);
        learn(use.key.repository, each, weight, {most_of_repository, of_one_repository}, now);
        learn(use.key.world, each, weight, {most_of_world, of_one_world}, now);
    }
    if (estimates_.size() > max_estimates)
        forget_oldest();
}

/// Half of them, so that this is rare.
void WorldCosts::forget_oldest()
{
    std::vector<TimePoint> seen;
    seen.reserve(estimates_.size());
    for (auto const& [digest, estimate] : estimates_)
        seen.push_back(estimate.seen);
    auto const middle = seen.begin() + static_cast<std::ptrdiff_t>(seen.size() / 2);
    std::ranges::nth_element(seen, middle);
    std::erase_if(estimates_, [limit = *middle](auto const& entry) { return entry.second.seen <= limit; });
}

} // namespace webots_cloud::placement
