#include "cgroup_limits.hpp"

#include "core/load/cgroup_text.hpp"
#include "core/text.hpp"

#include <webots_cloud/time.hpp>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;

std::string read(fs::path const& path)
{
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// What the two versions call the same.
struct MemoryFiles
{
    char const* limit;
    char const* used;
    char const* unused_pages; ///< In `memory.stat`: of files, read or written once,
    char const* used_pages;   ///< and again. The kernel gives back both when memory is wanted.
};

constexpr MemoryFiles memory_files[] = {
    {"memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file", "total_active_file"},
    {"memory.max", "memory.current", "inactive_file", "active_file"},
};

/// Percent of the group's memory that is in use, without the cache of files, which the kernel gives back when
/// memory is wanted: so it counts the machine's available memory too. A build fills it, and it stays. 0
/// without a limit.
double memory_percent(fs::path const& group, MemoryFiles const& files, std::uint64_t machine)
{
    auto const limit = core::cgroup_number(read(group / files.limit));
    if (!limit || *limit == 0 || *limit >= machine)
        return 0;
    auto const used = core::cgroup_number(read(group / files.used)).value_or(0);
    auto const figures = read(group / "memory.stat");
    auto const cache =
        core::cgroup_value(figures, files.unused_pages) + core::cgroup_value(figures, files.used_pages);
    return std::min(100.0,
                    100 * static_cast<double>(used - std::min(used, cache)) / static_cast<double>(*limit));
}

std::optional<double> processor_limit(fs::path const& group, int version)
{
    if (version == 2)
        return core::processor_limit(read(group / "cpu.max"));
    auto const quota = read(group / "cpu.cfs_quota_us");
    auto const period = read(group / "cpu.cfs_period_us");
    return core::processor_limit(core::concat(core::trim(quota), " ", core::trim(period)));
}

/// The microseconds of processors that a group has used. In version 1 another controller counts them, which
/// is usually, not always, mounted together with this one.
std::optional<std::uint64_t> processor_use(fs::path const& group, int version)
{
    if (version == 2)
        return core::cgroup_value(read(group / "cpu.stat"), "usage_usec");
    auto const nanoseconds = core::cgroup_number(read(group / "cpuacct.usage"));
    return nanoseconds ? std::optional(*nanoseconds / 1000) : std::nullopt;
}

std::uint64_t microseconds_of(double processors)
{
    auto const now = std::chrono::steady_clock::now().time_since_epoch();
    return static_cast<std::uint64_t>(std::chrono::duration<double, std::micro>(now).count() * processors);
}

} // namespace

CgroupLimits::CgroupLimits(fs::path const& root, fs::path const& own)
{
    auto const text = read(own);
    memory_ = find(root, text, "memory");
    processors_ = find(root, text, "cpu");
}

CgroupLimits::Groups CgroupLimits::find(fs::path const& root, std::string_view own,
                                        std::string_view controller)
{
    Groups groups;
    auto path = core::own_cgroup(own, controller);
    auto group = root;
    if (!path.empty()) {
        groups.version = 1;
        group /= controller;
    } else {
        path = core::own_cgroup(own);
    }
    // ".." leads out of a container: those limits are not ours to see
    if (path.empty() || path.find("..") != std::string_view::npos)
        return groups;
    groups.folders.push_back(group);
    for (auto const& part : fs::path(path).relative_path())
        groups.folders.push_back(group /= part);
    return groups;
}

void CgroupLimits::apply(HostSample& sample, int processors, std::uint64_t memory) const
{
    for (auto const& group : memory_.folders)
        sample.memory_used =
            std::max(sample.memory_used, memory_percent(group, memory_files[memory_.version - 1], memory));
    double min = processors;
    // The lowest limit on the way down to our own group is the one that counts.
    for (auto const& group : processors_.folders) {
        auto const limit = processor_limit(group, processors_.version);
        auto const used = processor_use(group, processors_.version);
        if (!limit || *limit <= 0 || *limit >= min || !used)
            continue;
        min = *limit;
        sample.share_busy = *used;
        sample.share_total = microseconds_of(min);
    }
}

} // namespace webots_cloud::adapters
