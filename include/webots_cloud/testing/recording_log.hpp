// A log that keeps its lines for the test to read.
#pragma once

#include <webots_cloud/transport/logger.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace webots_cloud::testing {

/// Lifetime: must outlive the loggers it made.
class RecordingLog
{
public:
    RecordingLog() = default;

    Logger logger()
    {
        return Logger([this](LogLevel, std::string_view line) { lines.emplace_back(line); }, LogLevel::debug);
    }

    /// True when some line contains `text`.
    bool contains(std::string_view text) const
    {
        return std::any_of(lines.begin(), lines.end(),
                           [&](std::string const& line) { return line.find(text) != std::string::npos; });
    }

    std::vector<std::string> lines;
};

} // namespace webots_cloud::testing
