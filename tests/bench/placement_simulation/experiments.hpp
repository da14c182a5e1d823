// The experiments of docs/scheduling.md: each prints its tables as Markdown and may draw one chart.
#pragma once

#include <cstdint>
#include <filesystem>
#include <iosfwd>
#include <optional>

namespace simulation {

struct Output
{
    std::ostream& tables;
    std::optional<std::filesystem::path> images; ///< A folder that exists.
    std::uint64_t seeds = 20; ///< Days of `campus`, `days` and `warm_starts`: seeds 1 to this.
};

void theory(Output& output);
void stale_reports(Output& output);
void classroom(Output& output);
void campus(Output& output);
void days(Output& output);
void warm_starts(Output& output);
void fleet(Output& output);

} // namespace simulation
