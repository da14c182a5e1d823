#include "build_limits.hpp"

#include "container_sizes.hpp"
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

namespace {

bool is_container(std::string_view text) noexcept
{
    return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return hex_digit(c) >= 0; });
}

} // namespace

std::optional<std::string> build_step(std::string_view line)
{
    auto const fields = split(trim(line), '\t');
    if (fields.size() != 2 || fields[1] != "\"\"" || !is_container(fields[0]))
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

std::vector<std::string> list_step_sizes(std::set<std::string> const& containers)
{
    std::vector<std::string> arguments{"ps", "--no-trunc", "--size", "--format", "{{.ID}}\t{{.Size}}"};
    for (auto const& container : containers) {
        arguments.emplace_back("--filter");
        arguments.push_back(concat("id=", container));
    }
    return arguments;
}

std::map<std::string, std::uint64_t> read_step_sizes(std::string_view listing)
{
    std::map<std::string, std::uint64_t> sizes;
    for (auto const line : split(listing, '\n')) {
        auto const fields = split(trim(line), '\t');
        if (fields.size() == 2 && is_container(fields[0]))
            sizes.emplace(fields[0], container_bytes(fields[1]));
    }
    return sizes;
}

} // namespace webots_cloud::core
