// What a session of a world costs, relative to the average session: learned from the machines' reports.
#pragma once

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/time.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::placement {

/// What is expected of one session.
struct ExpectedCost
{
    double mean = 1;     ///< 1 is the average session.
    double variance = 0; ///< Of that, where the mean is not all that is known; see `is_known`.
    bool is_known = false;
    double memory = 0;   ///< Bytes, where its world is known; 0: nobody has said.
    double graphics = 1; ///< As `mean`, of graphics processors.
};

/// A machine's size, which none of its simulations exceeds.
struct MachineSize
{
    double processors = 0;
    double memory = 0; ///< Bytes; 0: it has not said.
    /// Graphics processors; none: it does not know what they do.
    std::optional<double> graphics = std::nullopt;
};

/// Estimates of worlds, towards those of their repositories, of their modes, and of the fleet, with weights
/// that fall as a world is seen for longer.
///
/// Costs are processors that a simulation keeps busy, so machines of any size teach one another; relative to
/// the average, so that nothing changes where no world is known. The same of graphics processors, where
/// machines know of them. What differs by more than a factor of four
/// from what is known already counts as just that, and no report weighs more than a minute of one session of
/// its world. Estimates fade with a time constant of two weeks, and the oldest are forgotten when there are
/// too many.
class WorldCosts
{
public:
    /// Of a session of that world; the average one where nothing is known of it.
    ExpectedCost expect(WorldKey const& key) const noexcept;

    /// Processors that the average session keeps busy; 0: nobody has said.
    double processors() const noexcept { return fleet_.mean; }

    /// The same of graphics processors.
    double graphics() const noexcept { return std::max(fleet_.graphics, 0.0); }

    /// One machine's report, `since_last` after the one before.
    void learn(std::vector<WorldUse> const& worlds, MachineSize size, Duration since_last, TimePoint now);

    std::size_t size() const noexcept { return estimates_.size(); }

    /// How many worlds, repositories and modes are remembered.
    static constexpr std::size_t max_estimates = 20'000;

    /// Lines of text, of at most `max_saved` estimates, those seen last.
    std::string save(TimePoint now) const;
    /// Nothing, if the text is of no save(), whatever else it is.
    static std::optional<WorldCosts> load(std::string_view text, TimePoint now);
    static constexpr std::size_t max_saved = 4000;

private:
    /// In processors for each session; `weight` in minutes of sessions.
    struct Estimate
    {
        double mean = 0;
        double weight = 0;
        double memory = 0;    ///< Bytes.
        double graphics = -1; ///< Graphics processors; negative: nobody has said.
        TimePoint seen{};
    };

    /// What one report says of a session.
    struct Sample
    {
        double processors;
        double memory;   ///< 0: nothing.
        double graphics; ///< Negative: nothing.
        double weight;
    };

    /// How an estimate takes samples: the most that it remembers, and the factor by which one may differ.
    struct Memory
    {
        double max_weight;
        double max_factor;
    };

    static void add(Estimate& estimate, Sample sample, Memory memory, TimePoint now) noexcept;
    void learn(std::uint64_t digest, Sample const& sample, Memory memory, TimePoint now);
    static void write(std::string& text, std::uint64_t digest, Estimate const& estimate, TimePoint now);
    Estimate const* find(std::uint64_t digest) const noexcept;
    void forget_oldest();

    std::unordered_map<std::uint64_t, Estimate> estimates_;
    Estimate fleet_;
};

} // namespace webots_cloud::placement
