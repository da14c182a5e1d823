// The limits that control groups set for us.
#pragma once

#include <webots_cloud/transport/host_metrics.hpp>

#include <filesystem>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// Our control group and those above it, each of which may limit us, of version 1 or 2. Where there are none
/// it changes nothing.
class CgroupLimits
{
public:
    /// `root` is where control groups are mounted, `own` the file that names ours: `/sys/fs/cgroup` and
    /// `/proc/self/cgroup`.
    CgroupLimits(std::filesystem::path const& root, std::filesystem::path const& own);

    /// Puts the limits that are lower than the machine's into a sample of it: a machine of `processors` and
    /// `memory` bytes.
    void apply(HostSample& sample, int processors, std::uint64_t memory) const;

private:
    /// The groups of one controller, from the outermost inwards, and the version that speaks for it.
    struct Groups
    {
        int version = 2;
        std::vector<std::filesystem::path> folders;
    };

    static Groups find(std::filesystem::path const& root, std::string_view own, std::string_view controller);

    Groups memory_;
    Groups processors_;
};

} // namespace webots_cloud::adapters
