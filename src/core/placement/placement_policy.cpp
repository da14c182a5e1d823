// The policies that come with the library.
#include <webots_cloud/scheduler.hpp>

#include <algorithm>
#include <array>
#include <bit>

namespace webots_cloud {

namespace {

/// Below this many unseen sessions of others, spreading costs more balance than it saves.
constexpr double negligible = 0.02;
/// Up to this many unseen sessions, the sixteen lowest machines determine the water level.
constexpr double much = 8;
constexpr double max_parts = 1 << 20; // so that it fits into an integer

/// Dahlin's interpretation of stale load: pour the sessions that others have probably placed unseen over the
/// least loaded machines, as water finds its level, and be like one of them: go to a machine with the
/// probability of the water it holds. With no others there is no water, and the least committed machine is
/// the answer.
std::size_t least_committed(PlacementSnapshot const& machines, RandomSource& random)
{
    double unseen = machines.unseen_arrivals();
    if (unseen < negligible)
        return machines.least_committed();
    // In a busy fleet a random part of the machines gives the same answer at less cost.
    auto const parts = std::bit_ceil(static_cast<std::size_t>(std::min(1 + unseen / much, max_parts)));
    unseen /= static_cast<double>(parts);
    std::array<std::size_t, PlacementSnapshot::max_lowest> lowest;
    std::size_t const found = machines.lowest(lowest, parts, random.uniform());
    if (found == 0)
        return machines.least_committed();

    // Water is poured over the machines, from the lowest up, until it no longer reaches the next one.
    std::array<double, PlacementSnapshot::max_lowest> bottom;
    std::array<double, PlacementSnapshot::max_lowest> width; // sessions per percent of score
    double level = 0;
    double widths = 0;
    double volume = unseen;
    std::size_t wet = 0;
    for (; wet != found; ++wet) {
        Candidate const machine = machines[lowest[wet]];
        bottom[wet] = machine.score;
        width[wet] = machine.weight / machine.cost;
        if (wet != 0 && level <= bottom[wet])
            break;
        volume += bottom[wet] * width[wet];
        widths += width[wet];
        level = volume / widths;
    }
    // A drop falls anywhere into it: the machine that it falls on is chosen.
    double drop = random.uniform() * unseen;
    for (std::size_t machine = 0; machine != wet; ++machine) {
        drop -= (level - bottom[machine]) * width[machine];
        if (drop < 0)
            return lowest[machine];
    }
    return lowest[0]; // rounding
}

/// The rule of the Python servers, kept for comparison: it herds.
std::size_t least_reported(PlacementSnapshot const& machines, RandomSource&)
{
    return machines.least_reported();
}

std::size_t anywhere(PlacementSnapshot const& machines, RandomSource& random)
{
    return random.below(machines.size());
}

/// The better of two different machines (Vvedenskaya et al. 1996; Mitzenmacher 1996).
std::size_t power_of_two(PlacementSnapshot const& machines, RandomSource& random)
{
    std::size_t const one = random.below(machines.size());
    if (machines.size() == 1)
        return one;
    std::size_t const step = 1 + random.below(machines.size() - 1);
    std::size_t const other = (one + step) % machines.size();
    return machines[other].load < machines[one].load ? other : one;
}

} // namespace

result<SchedulingPolicy> scheduling_policy(std::string_view name)
{
    if (name == "least_committed")
        return SchedulingPolicy(least_committed);
    if (name == "least_reported")
        return SchedulingPolicy(least_reported);
    if (name == "random")
        return SchedulingPolicy(anywhere);
    if (name == "power_of_two")
        return SchedulingPolicy(power_of_two);
    return Failure(errc::invalid_argument,
                   "scheduling: found \"" + std::string(name) +
                       "\", wanted least_committed, least_reported, random or power_of_two");
}

} // namespace webots_cloud
