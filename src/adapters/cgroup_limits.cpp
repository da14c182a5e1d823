#include "cgroup_limits.hpp"

#include "../core/cgroup_text.hpp"

#include <webots_cloud/time.hpp>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <iterator>
#include <string>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;

std::string read(fs::path const& path)
{
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// Percent of the group's memory that is in use, without what the kernel would give back at once; 0 without a
/// limit.
double memory_percent(fs::path const& group, std::uint64_t machine)
{
    auto const limit = core::cgroup_number(read(group / "memory.max"));
    if (!limit || *limit == 0 || *limit >= machine)
        return 0;
    auto const used = core::cgroup_number(read(group / "memory.current")).value_or(0);
    auto const cache = core::cgroup_value(read(group / "memory.stat"), "inactive_file");
    return std::min(100.0,
                    100 * static_cast<double>(used - std::min(used, cache)) / static_cast<double>(*limit));
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
    auto const path = core::unified_cgroup(text);
    if (path.empty() ||
        path.find("..") !=
            std::string_view::npos) // ".." leads out of a container: those limits are not ours to see
        return;
    auto group = root;
    groups_.push_back(group);
    for (auto const& part : fs::path(path).relative_path())
        groups_.push_back(group /= part);
}

void CgroupLimits::apply(HostSample& sample, int processors, std::uint64_t memory) const
{
    double least = processors;
    for (auto const& group : groups_) {
        sample.memory_used = std::max(sample.memory_used, memory_percent(group, memory));
        auto const limit = core::processor_limit(read(group / "cpu.max"));
        if (!limit || *limit <= 0 || *limit >= least)
            continue;
        least = *limit;
        sample.share_busy = core::cgroup_value(read(group / "cpu.stat"), "usage_usec");
        sample.share_total = microseconds_of(least);
    }
}

} // namespace webots_cloud::adapters
