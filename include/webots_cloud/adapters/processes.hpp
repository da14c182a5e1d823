// Programs that are started here, under guards and within limits.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <filesystem>
#include <memory>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Where control groups are found.
struct ControlGroupsParams
{
    ControlGroupsParams() = default;

    bool enabled = true; ///< False: none are made.
    std::filesystem::path mounts = "/proc/self/mountinfo";
    std::filesystem::path own_group = "/proc/self/cgroup"; ///< The file that names ours.
    /// With version 2, groups may be made beside all others where our own group has other programs in it.
    bool may_use_root = false;
};

/// Groups of processes that the kernel keeps within limits: one for each program that has limits.
class ControlGroups;

/// Tries what works here. Those that a killed server has left are removed.
std::shared_ptr<ControlGroups> make_control_groups(ControlGroupsParams const& params = ControlGroupsParams());

LimitSupport limit_support(ControlGroups const& groups);

/// Folders that programs in such groups must not be able to change, lest they leave them.
std::vector<std::filesystem::path> control_group_mounts(ControlGroups const& groups);

/// Processes of this computer over Boost.Process, each under a guard (the program `webots-process-guard`)
/// that ends the whole tree when asked to, when the process ends, and when we die, however we die.
///
/// The processes can't change the existing folders `read_only`, where the kernel allows a mount namespace.
/// `groups` keep them within their limits; null: whoever looks at `Process::usage` does. `graphics`: what
/// that knows of graphics processors; null: nothing.
std::unique_ptr<ProcessHost> make_process_host(boost::asio::any_io_executor executor,
                                               std::filesystem::path guard,
                                               std::vector<std::filesystem::path> read_only = {},
                                               std::shared_ptr<ControlGroups> groups = nullptr,
                                               std::shared_ptr<GraphicsTimes const> graphics = nullptr);

} // namespace webots_cloud
