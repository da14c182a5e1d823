// Control groups for simulations, see `core/sandbox/control_groups.hpp`.
#pragma once

#include <webots_cloud/adapters/processes.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace webots_cloud {

/// Makes the groups.
///
/// Thread-safety: any thread.
class ControlGroups
{
public:
    /// Finds out what works here, and removes what a killed server has left. Blocks for some system calls.
    explicit ControlGroups(ControlGroupsParams const& params);

    /// The groups of one simulation, one in each hierarchy.
    struct Group
    {
        Group() = default;

        int memory = 0; ///< The version of the group that counts it; 0: none does.
        int processes = 0;
        int processors = 0;
        std::filesystem::path memory_folder;
        std::filesystem::path process_folder;
        std::filesystem::path processor_folder;
        std::vector<std::filesystem::path> folders; ///< All of them, each once.
    };

    LimitSupport const& support() const noexcept { return support_; }

    /// Where they are mounted: simulations must not write there.
    std::vector<std::filesystem::path> const& mounts() const noexcept { return mounts_; }

    /// Errors: `start_failed`.
    result<Group> make(ProcessLimits const& limits);

    /// What the processes in it use, and what the kernel has refused them.
    static ProcessUsage usage(Group const& group);

    /// Removes a group in which no process is left; later, if the kernel is not ready for that.
    void remove(Group const& group);

private:
    struct Parent
    {
        std::string controller;
        int version = 0;
        std::filesystem::path folder;
    };

    void add_parent(ControlGroupsParams const& params, std::string const& mountinfo, std::string const& own,
                    std::string_view controller);
    std::string prepare(std::filesystem::path const& folder, std::filesystem::path const& root);
    void remove_stale();
    void remove_removable();
    void try_out();

    int process_;
    LimitSupport support_;
    std::vector<Parent> parents_;
    std::vector<std::filesystem::path> mounts_;
    std::mutex mutex_;
    std::uint64_t made_ = 0;
    std::vector<std::filesystem::path> left_; ///< To be removed.
    bool has_young_ = false;                  ///< Stale ones may be left.
};

} // namespace webots_cloud
