// Knows both versions of control groups: where they are mounted, what their files are called, and how to read
// them. The system calls are in adapters/process/control_groups.cpp.
#include "control_groups.hpp"

#include "core/load/cgroup_text.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <charconv>
#include <initializer_list>
#include <optional>

namespace webots_cloud::core {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view prefix = "webots_cloud-";
constexpr std::uint64_t period_us = 100'000; // the kernel's own default
constexpr std::uint64_t min_quota_us = 1'000;

/// A line of `mountinfo`: number, parent, device, root, mount point, options, further fields, "-", type,
/// source, options of the file system.
struct Mount
{
    std::string_view root;
    std::string_view point;
    std::string_view type;
    std::string_view options;
};

std::optional<Mount> parse_mount(std::string_view line)
{
    auto const fields = split(line, ' ');
    auto const dash = std::find(fields.begin(), fields.end(), "-");
    if (fields.size() < 7 || fields.end() - dash < 4)
        return std::nullopt;
    Mount mount;
    mount.root = fields[3];
    mount.point = fields[4];
    mount.type = dash[1];
    mount.options = dash[3];
    return mount;
}

bool has_word(std::string_view list, char separator, std::string_view word)
{
    auto const words = split(list, separator);
    return std::any_of(words.begin(), words.end(),
                       [word](std::string_view each) { return trim(each) == word; });
}

/// What `path` is below `root`; nothing: it lies elsewhere.
std::optional<std::string_view> below(std::string_view path, std::string_view root)
{
    if (path.find("..") != std::string_view::npos) // of another namespace
        return std::nullopt;
    if (root == "/")
        return path;
    if (!path.starts_with(root) || (path.size() > root.size() && path[root.size()] != '/'))
        return std::nullopt;
    return path.substr(root.size());
}

GroupPlace place(int version, Mount const& mount, std::string_view own)
{
    GroupPlace found;
    auto const path = below(own, mount.root);
    if (own.empty() || !path)
        return found;
    found.version = version;
    found.mount = mount.point;
    found.folder = mount.point;
    for (auto const& part : fs::path(*path).relative_path())
        if (!part.empty())
            found.folder /= part;
    return found;
}

} // namespace

GroupPlace find_place(std::string_view mountinfo, std::string_view own_groups, std::string_view controller)
{
    GroupPlace second;
    for (auto const line : split(mountinfo, '\n')) {
        auto const mount = parse_mount(line);
        if (!mount)
            continue;
        // Where both versions are mounted, a controller that is in the first one is missing in the second.
        if (mount->type == "cgroup" && has_word(mount->options, ',', controller))
            return place(1, *mount, own_cgroup(own_groups, controller));
        if (mount->type == "cgroup2" && second.version == 0)
            second = place(2, *mount, own_cgroup(own_groups));
    }
    return second;
}

std::string group_name(int server, std::uint64_t number)
{
    return concat(prefix, std::to_string(server), "-", std::to_string(number));
}

int server_of_group(std::string_view name) noexcept
{
    if (!name.starts_with(prefix))
        return 0;
    name.remove_prefix(prefix.size());
    int server = 0;
    auto const [end, error] = std::from_chars(name.data(), name.data() + name.size(), server);
    return error == std::errc() && end != name.data() + name.size() && *end == '-' ? server : 0;
}

Preparation prepare_parent(ParentGroup const& parent, int own_process)
{
    Preparation preparation;
    bool has_any = false;
    for (auto const controller : {memory_controller, process_controller, processor_controller}) {
        if (!has_word(trim(parent.controllers), ' ', controller))
            continue;
        has_any = true;
        if (!has_word(trim(parent.enabled), ' ', controller))
            preparation.enable += concat(preparation.enable.empty() ? "+" : " +", controller);
    }
    if (!has_any)
        preparation.problem = "it has no controllers, see \"Delegate\" of systemd";
    // There is nothing to lend to others, or this is the root, in which processes may stay all the same.
    if (preparation.enable.empty() || parent.is_root)
        return preparation;
    for (auto const line : split(parent.processes, '\n')) {
        auto const process = trim(line);
        if (process == std::to_string(own_process))
            preparation.move = true;
        else if (!process.empty())
            preparation.problem = "other programs are in it";
    }
    return preparation;
}

std::vector<GroupFile> limit_files(int version, std::string_view controller, ProcessLimits const& limits)
{
    std::vector<GroupFile> files;
    auto const add = [&files](std::string_view name, std::string value, bool required) {
        files.emplace_back(name, std::move(value), required);
    };
    if (controller == memory_controller && limits.memory > 0) {
        auto const bytes = std::to_string(limits.memory);
        if (version == 1) {
            add("memory.limit_in_bytes", bytes, true);
            add("memory.memsw.limit_in_bytes", bytes, false); // no swap besides
        } else {
            add("memory.max", bytes, true);
            add("memory.swap.max", "0", false);
            add("memory.oom.group", "1", false); // a simulation without one of its processes is of no use
        }
    }
    if (controller == process_controller && limits.processes > 0)
        add("pids.max", std::to_string(limits.processes), true);
    if (controller == processor_controller && limits.processors > 0) {
        auto const quota = std::max(
            min_quota_us, static_cast<std::uint64_t>(limits.processors * static_cast<double>(period_us)));
        if (version == 1) {
            add("cpu.cfs_period_us", std::to_string(period_us), true);
            add("cpu.cfs_quota_us", std::to_string(quota), true);
        } else {
            add("cpu.max", concat(std::to_string(quota), " ", std::to_string(period_us)), true);
        }
    }
    return files;
}

UsageFiles usage_files(int version) noexcept
{
    UsageFiles files;
    files.memory = version == 1 ? "memory.usage_in_bytes" : "memory.current";
    files.memory_events = version == 1 ? "memory.oom_control" : "memory.events";
    files.processors = version == 1 ? "cpuacct.usage" : "cpu.stat";
    return files;
}

std::uint64_t group_memory(int version, std::string_view usage, std::string_view stat) noexcept
{
    auto const used = cgroup_number(usage).value_or(0);
    auto const cache =
        version == 1 ? cgroup_value(stat, "total_inactive_file") + cgroup_value(stat, "total_active_file")
                     : cgroup_value(stat, "inactive_file") + cgroup_value(stat, "active_file");
    return used - std::min(used, cache);
}

std::uint64_t group_processor_time(int version, std::string_view text) noexcept
{
    return version == 1 ? cgroup_number(text).value_or(0) / 1000 : cgroup_value(text, "usage_usec");
}

std::uint64_t group_processes(std::string_view text) noexcept
{
    return cgroup_number(text).value_or(0);
}

std::uint64_t group_memory_kills(std::string_view events) noexcept
{
    return cgroup_value(events, "oom_kill");
}

std::uint64_t group_refused_forks(std::string_view events) noexcept
{
    return cgroup_value(events, "max");
}

} // namespace webots_cloud::core
