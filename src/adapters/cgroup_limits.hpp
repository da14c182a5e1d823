// What control groups (version 2) leave us of the machine.
#pragma once

#include <webots_cloud/transport/host_metrics.hpp>

#include <filesystem>
#include <vector>

namespace webots_cloud::adapters {

/// Our control group and those above it, each of which may limit us. Where there are none it changes nothing.
class CgroupLimits
{
public:
    /// `root` is where control groups are mounted, `own` the file that names ours: `/sys/fs/cgroup` and
    /// `/proc/self/cgroup`.
    CgroupLimits(std::filesystem::path const& root, std::filesystem::path const& own);

    /// Puts the limits that are lower than the machine's into a look at it: a machine of `processors` and
    /// `memory` bytes.
    void apply(HostSample& sample, int processors, std::uint64_t memory) const;

private:
    std::vector<std::filesystem::path> groups_;
};

} // namespace webots_cloud::adapters
