// Learns from reports what a session of a world costs, and forgets slowly. A world that is new begins with
// what its repository, its mode or the whole fleet costs. docs/scheduling.md says how well that works.
#include "world_costs.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <utility>
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
constexpr double most_at_once = 1; // of one report

constexpr double of_one_world = 4; // what differs by a larger factor counts as this
constexpr double of_one_repository = 10;
constexpr double of_any = 50;
constexpr double enough_to_clip = 0.5; // min
constexpr double max_relative = 50;    // of the fleet's mean
constexpr double min_relative = 0.02;
constexpr double least_processors = 0.001; // or graphics processors, to judge others by
/// No machine outweighs a fleet by the sessions that it claims to have.
constexpr double most_sessions = 64;
constexpr double most_weight = most_of_fleet + most_sessions;
constexpr double max_memory = 1e15; // bytes
/// The relative standard deviation of the sessions of one world.
constexpr double within_world = 0.25;
/// The time constant of estimates that fade, in seconds: two weeks.
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
    // From the fleet to the world itself: the more is known of what is narrower, the less counts what is
    // wider.
    double mean = fleet_.mean;
    double graphics = fleet_.graphics;
    double known = 0;
    for (Level const& level :
         {Level{key.mode, own_mode}, Level{key.repository, own_repository}, Level{key.world, own_world}}) {
        Estimate const* const estimate = find(level.digest);
        known = estimate ? estimate->weight / (estimate->weight + level.own) : 0;
        if (estimate)
            mean += known * (estimate->mean - mean);
        if (estimate && estimate->graphics >= 0)
            graphics += known * (estimate->graphics - graphics);
    }
    expected.mean = std::clamp(mean / fleet_.mean, min_relative, max_relative);
    if (fleet_.graphics > 0)
        expected.graphics = std::clamp(graphics / fleet_.graphics, 0.0, max_relative);
    expected.is_known = known > 0.5;
    double const spread = within_world * expected.mean;
    expected.variance = spread * spread;
    // Never guessed from other worlds: it closes machines.
    if (auto const* const own = find(key.world); own && expected.is_known)
        expected.memory = own->memory;
    return expected;
}

void WorldCosts::add(Estimate& estimate, Sample sample, Memory memory, TimePoint now) noexcept
{
    double const away = std::max(0.0, std::chrono::duration<double>(now - estimate.seen).count());
    auto const usual = [&](double number, double mean) {
        return std::clamp(number, mean / memory.max_factor, mean * memory.max_factor);
    };
    estimate.seen = now;
    estimate.weight = std::min(estimate.weight * fading / (fading + away), memory.max_weight);
    // Once it is known what is usual, an outlier counts as no more than a multiple of that.
    if (estimate.weight > enough_to_clip) {
        sample.processors = usual(sample.processors, estimate.mean);
        if (sample.memory > 0 && estimate.memory > 0)
            sample.memory = usual(sample.memory, estimate.memory);
        if (estimate.graphics >= 0) // much more than is usual counts as that; less may be none at all
            sample.graphics =
                std::min(sample.graphics, std::max(estimate.graphics, least_processors) * memory.max_factor);
    }
    estimate.weight += sample.weight;
    double const part = sample.weight / estimate.weight;
    estimate.mean += (sample.processors - estimate.mean) * part;
    if (sample.memory > 0)
        estimate.memory =
            estimate.memory > 0 ? estimate.memory + (sample.memory - estimate.memory) * part : sample.memory;
    if (sample.graphics >= 0)
        estimate.graphics = estimate.graphics < 0
                                ? sample.graphics
                                : estimate.graphics + (sample.graphics - estimate.graphics) * part;
}

void WorldCosts::learn(std::uint64_t digest, Sample const& sample, Memory memory, TimePoint now)
{
    Estimate& estimate = estimates_[digest];
    if (estimate.weight == 0)
        estimate.seen = now;
    add(estimate, sample, memory, now);
}

void WorldCosts::learn(std::vector<WorldUse> const& worlds, MachineSize size, Duration since_last,
                       TimePoint now)
{
    double const minutes = std::chrono::duration<double, std::ratio<60>>(since_last).count();
    double const most_memory = size.memory > 0 ? std::min(size.memory, max_memory) : max_memory;
    for (WorldUse const& use : worlds) {
        if (use.running <= 0 || minutes <= 0)
            continue;
        Sample sample;
        sample.processors =
            std::max(std::min(use.processors / use.running, size.processors), least_processors);
        sample.memory = std::min(use.memory / use.running, most_memory);
        sample.graphics = size.graphics ? std::min(use.graphics / use.running, *size.graphics) : -1;
        sample.weight = std::min(minutes * use.running, most_at_once);
        Sample of_all = sample;
        if (fleet_.weight == 0)
            fleet_.seen = now;
        double const sessions = use.running;
        // The fleet's mean is over all sessions, so its weights are.
        of_all.weight = minutes * std::min(sessions, most_sessions);
        add(fleet_, of_all, {most_of_fleet, of_any}, now);
        learn(use.key.mode, sample, {most_of_fleet, of_any}, now);
        learn(use.key.repository, sample, {most_of_repository, of_one_repository}, now);
        learn(use.key.world, sample, {most_of_world, of_one_world}, now);
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

namespace {

/// The first line; another version of the format gets another number.
constexpr std::string_view title = "webots_cloud costs of worlds 2\n";
constexpr double max_processors = 100'000;     // or graphics processors
constexpr double max_age = 10 * 365 * 86400.0; // s

/// The next word of `line`, as a number from 0 up to `max`.
std::optional<double> take_number(std::string_view& line, double max)
{
    if (!line.starts_with(' '))
        return std::nullopt;
    line.remove_prefix(1);
    double number = 0;
    auto const [end, error] = std::from_chars(line.data(), line.data() + line.size(), number);
    if (error != std::errc() || !(number >= 0 && number <= max))
        return std::nullopt;
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    return number;
}

std::optional<std::uint64_t> take_digest(std::string_view& line)
{
    std::uint64_t digest = 0;
    auto const [end, error] = std::from_chars(line.data(), line.data() + line.size(), digest, 16);
    if (error != std::errc())
        return std::nullopt;
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    return digest;
}

void append(std::string& text, double number)
{
    std::array<char, 32> digits{};
    auto const end =
        std::to_chars(digits.data(), digits.data() + digits.size(), number, std::chars_format::general, 5)
            .ptr;
    text += ' ';
    text.append(digits.data(), end);
}

} // namespace

void WorldCosts::write(std::string& text, std::uint64_t digest, Estimate const& estimate, TimePoint now)
{
    std::array<char, 16> digits{};
    text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), digest, 16).ptr);
    append(text, estimate.mean);
    append(text, std::min(estimate.weight, most_weight)); // more, after a silence, would not be read again
    append(text, estimate.memory);
    append(text, std::max(estimate.graphics, 0.0));
    append(text, std::clamp(std::chrono::duration<double>(now - estimate.seen).count(), 0.0, max_age));
    text += '\n';
}

/// The fleet comes first, under a digest that is not looked at.
std::string WorldCosts::save(TimePoint now) const
{
    std::string text(title);
    write(text, 0, fleet_, now);
    std::vector<std::pair<TimePoint, std::uint64_t>> latest;
    latest.reserve(estimates_.size());
    for (auto const& [digest, estimate] : estimates_)
        latest.emplace_back(estimate.seen, digest);
    std::ranges::sort(latest, std::greater());
    latest.resize(std::min(latest.size(), max_saved));
    for (auto const& [seen, digest] : latest)
        write(text, digest, estimates_.at(digest), now);
    return text;
}

std::optional<WorldCosts> WorldCosts::load(std::string_view text, TimePoint now)
{
    if (!text.starts_with(title))
        return std::nullopt;
    text.remove_prefix(title.size());
    WorldCosts costs;
    for (std::size_t number = 0; !text.empty(); ++number) {
        auto const end = text.find('\n');
        if (end == std::string_view::npos || number > max_saved)
            return std::nullopt;
        std::string_view line = text.substr(0, end);
        text.remove_prefix(end + 1);
        auto const digest = take_digest(line);
        auto const mean = digest ? take_number(line, max_processors) : std::nullopt;
        auto const weight = mean ? take_number(line, most_weight) : std::nullopt;
        auto const memory = weight ? take_number(line, max_memory) : std::nullopt;
        auto const graphics = memory ? take_number(line, max_processors) : std::nullopt;
        auto const age = graphics ? take_number(line, max_age) : std::nullopt;
        if (!age || !line.empty())
            return std::nullopt;
        Estimate estimate;
        estimate.mean = std::max(*mean, least_processors);
        estimate.weight = *weight;
        estimate.memory = *memory;
        estimate.graphics =
            *graphics > 0 ? *graphics : -1; // of one that uses none, that is soon learned again
        estimate.seen = now - std::chrono::duration_cast<Duration>(std::chrono::duration<double>(*age));
        (number == 0 ? costs.fleet_ : costs.estimates_[*digest]) = estimate;
    }
    return costs;
}

} // namespace webots_cloud::placement
