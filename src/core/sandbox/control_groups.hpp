// How the kernel's control groups, of version 1 or 2, keep simulations within limits: which files are
// written, and what is read.
#pragma once

#include "limits.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// What counts and limits something, by the name that the kernel has for it.
inline constexpr std::string_view memory_controller = "memory";
inline constexpr std::string_view process_controller = "pids";
inline constexpr std::string_view processor_controller = "cpu";
inline constexpr std::string_view accounting_controller = "cpuacct"; ///< Version 1 counts apart.

/// Where groups can be made.
struct GroupPlace
{
    GroupPlace() = default;

    int version = 0; ///< 0: nowhere.
    std::filesystem::path mount;
    std::filesystem::path folder; ///< Of the group that this process is in.
};

/// Where the groups of a controller are: in its hierarchy of version 1 if there is one, else in that of
/// version 2, which may or may not have it. `mountinfo` and `own_groups` are files of `/proc/self`.
GroupPlace find_place(std::string_view mountinfo, std::string_view own_groups, std::string_view controller);

/// The group of the server itself in version 2, where a group with subgroups has no processes.
inline constexpr std::string_view server_group = "webots_cloud-server";

/// The name of a group for a simulation, and the server's process number in such a name; 0: it is none.
std::string group_name(int server, std::uint64_t number);
int server_of_group(std::string_view name) noexcept;

/// The state of a group of version 2 in which groups for simulations shall be made.
struct ParentGroup
{
    ParentGroup() = default;

    std::string controllers; ///< `cgroup.controllers`
    std::string enabled;     ///< `cgroup.subtree_control`
    std::string processes;   ///< `cgroup.procs`
    bool is_root = false;    ///< Of the whole hierarchy, where processes don't matter.
};

/// What must be done first.
struct Preparation
{
    Preparation() = default;

    std::string problem; ///< Not empty: nothing helps.
    bool move = false;   ///< This process must move into a group below.
    std::string enable;  ///< To be written to `cgroup.subtree_control`; empty: nothing.
};

Preparation prepare_parent(ParentGroup const& parent, int own_process);

struct GroupFile
{
    GroupFile(std::string_view file, std::string text, bool must)
        : name(file), value(std::move(text)), required(must)
    {}

    std::string name;
    std::string value;
    bool required; ///< False: some kernels don't have it, and the limit holds all the same.
};

/// What to write into a new group, in order.
std::vector<GroupFile> limit_files(int version, std::string_view controller, ProcessLimits const& limits);

/// The files that tell what a group uses.
struct UsageFiles
{
    UsageFiles() = default;

    char const* memory = nullptr;
    char const* memory_events = nullptr;
    char const* processors = nullptr;
};

UsageFiles usage_files(int version) noexcept;

/// Bytes, without the cache of files, which the kernel gives back when memory is wanted.
std::uint64_t group_memory(int version, std::string_view usage, std::string_view stat) noexcept;

/// Microseconds, from the file of `usage_files`.
std::uint64_t group_processor_time(int version, std::string_view text) noexcept;

/// Processes and threads, from `pids.current`.
std::uint64_t group_processes(std::string_view text) noexcept;

/// Processes that were killed, from the file of `usage_files`.
std::uint64_t group_memory_kills(std::string_view events) noexcept;

/// Processes that were not started, from `pids.events`.
std::uint64_t group_refused_forks(std::string_view events) noexcept;

} // namespace webots_cloud::core
