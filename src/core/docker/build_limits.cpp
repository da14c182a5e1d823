#include "build_limits.hpp"

#include "core/text.hpp"
#include "labels.hpp"

#include <algorithm>

namespace webots_cloud::core {

std::vector<std::string> watch_starts(std::string_view identity, WallTime since)
{
    auto const seconds = std::chrono::duration_cast<std::chrono::seconds>(since.time_since_epoch());
    return {"events",
            "--since",
            std::to_string(seconds.count()),
            "--filter",
            "event=start",
            "--filter",
            concat("label=", server_label, "=", identity),
            "--format",
            concat("{{.ID}}\t{{json (index .Actor.Attributes \"", project_label, "\")}}")};
}

std::optional<std::string> build_step(std::string_view line)
{
    auto const fields = split(trim(line), '\t');
    bool const is_number = !fields[0].empty() && std::all_of(fields[0].begin(), fields[0].end(),
                                                             [](char c) { return hex_digit(c) >= 0; });
    if (fields.size() != 2 || fields[1] != "\"\"" || !is_number)
        return std::nullopt;
    return std::string(fields[0]);
}

std::vector<std::string> limit_container(ProcessLimits const& limits, std::string_view container)
{
    std::vector<std::string> arguments{"update"};
    auto const add = [&arguments](std::string name, std::string value) {
        arguments.push_back(std::move(name));
        arguments.push_back(std::move(value));
    };
    if (limits.memory > 0) {
        add("--memory", std::to_string(limits.memory));
        add("--memory-swap", std::to_string(limits.memory));
    }
    if (limits.processors > 0)
        add("--cpus", python_float(limits.processors));
    if (limits.processes > 0)
        add("--pids-limit", std::to_string(limits.processes));
    if (arguments.size() == 1)
        return {};
    arguments.emplace_back(container);
    return arguments;
}

} // namespace webots_cloud::core
