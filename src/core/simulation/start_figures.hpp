// Counts how starts of simulations ended, and how long their stages took, for /metrics.
#pragma once

#include "core/pages/metrics_text.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <array>
#include <cstdint>
#include <map>
#include <string_view>

namespace webots_cloud::core {

/// The stages of a start, in order.
enum class StartStage
{
    fetch,  ///< From the request to the project on disk.
    launch, ///< From there to the running program.
    ready   ///< From there to the loaded world.
};

/// Why a start failed, as a label: one of a small fixed set.
std::string_view start_failure_label(Failure const& failure) noexcept;

/// A count for each of these labels.
std::map<std::string_view, std::uint64_t> no_failures();

class StartFigures
{
public:
    void arrived() { ++arrivals_; } ///< A browser asked for a simulation.
    void passed(StartStage stage, Duration took);
    void failed(Failure const& failure) { ++failed_[start_failure_label(failure)]; }
    void abandoned() { ++abandoned_; } ///< The browser left before it was ready.

    std::uint64_t arrivals() const noexcept { return arrivals_; }
    /// Starts that failed or were abandoned.
    std::uint64_t lost() const noexcept;

    void write(MetricsText& text) const;

private:
    static Histogram stage_histogram() { return {0.1, 0.25, 0.5, 1, 2.5, 5, 10, 25, 60, 150, 300}; }

    std::uint64_t arrivals_ = 0;
    /// Seconds, by stage. From a project that is there already to a large one, or a large world.
    std::array<Histogram, 3> stages_{stage_histogram(), stage_histogram(), stage_histogram()};
    std::map<std::string_view, std::uint64_t> failed_ = no_failures();
    std::uint64_t abandoned_ = 0;
};

/// Counts projects that were to be fetched for later starts, and how that ended.
class FetchFigures
{
public:
    void fetched() { ++fetched_; }
    void failed(Failure const& failure) { ++failed_[start_failure_label(failure)]; }
    void abandoned() { ++abandoned_; } ///< The browser left before the project was here.

    void write(MetricsText& text) const;

private:
    std::uint64_t fetched_ = 0;
    std::map<std::string_view, std::uint64_t> failed_ = no_failures();
    std::uint64_t abandoned_ = 0;
};

} // namespace webots_cloud::core
