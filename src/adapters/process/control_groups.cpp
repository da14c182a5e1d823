// Writes and reads the kernel's files; core/sandbox/control_groups decides which. What works is found out by
// trying when the server starts, since it depends on kernel, service and user.
#include "control_groups.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "core/sandbox/control_groups.hpp"
#include "core/text.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <string_view>
#include <system_error>
#include <utility>

namespace webots_cloud {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr std::chrono::seconds youth{10}; ///< many times what a program needs to join its group

std::string read(fs::path const& path)
{
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

/// Returns: what went wrong; empty: nothing.
std::string write(fs::path const& path, std::string_view text)
{
    // The kernel's files are there, and in its folders no others can be made.
    adapters::FileDescriptor const file(::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644));
    if (file && ::write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size()))
        return {};
    return concat(path.string(), " can't be written: ", std::generic_category().message(errno));
}

std::string make_folder(fs::path const& path)
{
    if (::mkdir(path.c_str(), 0755) == 0 || errno == EEXIST)
        return {};
    return concat(path.string(), " can't be made: ", std::generic_category().message(errno));
}

void add_once(std::vector<fs::path>& paths, fs::path const& path)
{
    if (std::find(paths.begin(), paths.end(), path) == paths.end())
        paths.push_back(path);
}

bool is_alive(int process)
{
    return ::kill(process, 0) == 0 || errno != ESRCH;
}

bool is_young(fs::path const& folder)
{
    std::error_code failed;
    auto const made = fs::last_write_time(folder, failed);
    return !failed && fs::file_time_type::clock::now() - made < youth;
}

/// Enough for the kernel to accept, to find out whether it does.
ProcessLimits trial_limits()
{
    ProcessLimits limits;
    limits.memory = std::uint64_t{1} << 30;
    limits.processors = 1;
    limits.processes = 100;
    return limits;
}

} // namespace

ControlGroups::ControlGroups(ControlGroupsParams const& params) : process_(::getpid())
{
    if (!params.enabled)
        return;
    auto const mountinfo = read(params.mounts);
    auto const own = read(params.own_group);
    for (auto const controller : {core::memory_controller, core::process_controller,
                                  core::processor_controller, core::accounting_controller})
        add_parent(params, mountinfo, own, controller);
    remove_stale();
    try_out();
}

/// Finds where groups of this controller can be made, and makes that ready.
void ControlGroups::add_parent(ControlGroupsParams const& params, std::string const& mountinfo,
                               std::string const& own, std::string_view controller)
{
    bool const counts_only = controller == core::accounting_controller;
    auto const place = core::find_place(mountinfo, own, controller);
    // Without the accounting of version 1 only a figure is missing; version 2 counts by itself.
    if (place.version == 0 && !counts_only)
        support_.problem = concat("no control groups are mounted for \"", controller, "\"");
    if (place.version == 0 || (place.version == 2 && counts_only))
        return;
    Parent parent;
    parent.controller = controller;
    parent.version = place.version;
    parent.folder = place.folder;
    if (place.version == 2) {
        // In version 2 a group that lends controllers to others has no processes of its own. So the server
        // moves to a group below, and may find itself there already.
        if (parent.folder.filename() == core::server_group)
            parent.folder = parent.folder.parent_path();
        auto problem = prepare(parent.folder, place.mount);
        // In a container the group of the server may be out of reach, but not the root of what is mounted.
        if (!problem.empty() && params.may_use_root && parent.folder != place.mount &&
            prepare(place.mount, place.mount).empty()) {
            parent.folder = place.mount;
            problem.clear();
        }
        auto const controllers = read(parent.folder / "cgroup.subtree_control");
        auto const enabled = concat(" ", core::trim(controllers), " ");
        if (problem.empty() && enabled.find(concat(" ", controller, " ")) == std::string::npos)
            problem = concat(parent.folder.string(), " has no controller \"", controller, "\"");
        if (!problem.empty()) {
            support_.problem = std::move(problem);
            return;
        }
    }
    add_once(mounts_, place.mount);
    parents_.push_back(std::move(parent));
}

/// Lets groups be made in a group of version 2.   Returns: what is in the way; empty: nothing.
std::string ControlGroups::prepare(fs::path const& folder, fs::path const& root)
{
    core::ParentGroup parent;
    parent.controllers = read(folder / "cgroup.controllers");
    parent.enabled = read(folder / "cgroup.subtree_control");
    parent.processes = read(folder / "cgroup.procs");
    std::error_code failed;
    parent.is_root = folder == root && !fs::exists(folder / "cgroup.type", failed);
    auto const preparation = core::prepare_parent(parent, process_);
    if (!preparation.problem.empty())
        return concat("the control group ", folder.string(), " can't be used: ", preparation.problem);
    if (preparation.move) {
        if (auto problem = make_folder(folder / core::server_group); !problem.empty())
            return problem;
        if (auto problem = write(folder / core::server_group / "cgroup.procs", std::to_string(process_));
            !problem.empty())
            return problem;
    }
    return preparation.enable.empty() ? std::string()
                                      : write(folder / "cgroup.subtree_control", preparation.enable);
}

/// The guards of a killed server end its simulations: their groups are empty. A server in another PID
/// namespace seems killed too, and its groups are empty until the simulation has joined: so young ones wait.
void ControlGroups::remove_stale()
{
    has_young_ = false;
    for (auto const& parent : parents_) {
        std::error_code failed;
        for (auto const& entry : fs::directory_iterator(parent.folder, failed)) {
            int const server = core::server_of_group(entry.path().filename().native());
            // Before we have made any, a group with our number is that of a server that has died.
            bool const is_own = server == process_ && made_ > 0;
            if (server == 0 || is_own || (server != process_ && is_alive(server)))
                continue;
            if (is_young(entry.path()))
                has_young_ = true;
            else
                ::rmdir(entry.path().c_str());
        }
    }
}

/// Makes a group for each controller alone, and drops those that refuse it.
void ControlGroups::try_out()
{
    auto const limits = trial_limits();
    auto const name = core::group_name(process_, 0);
    auto const is_unusable = [&](Parent const& parent) {
        auto const folder = parent.folder / name;
        auto problem = make_folder(folder);
        for (auto const& file : core::limit_files(parent.version, parent.controller, limits))
            if (problem.empty() && file.required)
                problem = write(folder / file.name, file.value);
        ::rmdir(folder.c_str());
        if (!problem.empty())
            support_.problem = problem;
        return !problem.empty();
    };
    std::erase_if(parents_, is_unusable);
    for (auto const& parent : parents_) {
        support_.memory = support_.memory || parent.controller == core::memory_controller;
        support_.processes = support_.processes || parent.controller == core::process_controller;
        support_.processors = support_.processors || parent.controller == core::processor_controller;
        support_.version = std::max(support_.version, parent.version);
    }
}

result<ControlGroups::Group> ControlGroups::make(ProcessLimits const& limits)
{
    std::string name;
    {
        std::lock_guard const lock(mutex_);
        name = core::group_name(process_, ++made_);
        remove_removable();
        if (has_young_)
            remove_stale();
    }
    Group group;
    for (auto const& parent : parents_) {
        auto const folder = parent.folder / name;
        auto problem = make_folder(folder);
        // In version 2 all controllers have the same folder.
        if (problem.empty())
            add_once(group.folders, folder);
        for (auto const& file : core::limit_files(parent.version, parent.controller, limits)) {
            auto const unwritten = problem.empty() ? write(folder / file.name, file.value) : std::string();
            if (file.required && !unwritten.empty())
                problem = unwritten;
        }
        if (!problem.empty()) {
            remove(group);
            return Failure(errc::start_failed, concat("its limits can't be set: ", problem));
        }
        if (parent.controller == core::memory_controller) {
            group.memory = parent.version;
            group.memory_folder = folder;
        } else if (parent.controller == core::process_controller) {
            group.processes = parent.version;
            group.process_folder = folder;
        } else if (parent.version == 2 || parent.controller == core::accounting_controller) {
            group.processors = parent.version;
            group.processor_folder = folder;
        }
    }
    return group;
}

ProcessUsage ControlGroups::usage(Group const& group)
{
    ProcessUsage usage;
    if (group.memory > 0) {
        auto const files = core::usage_files(group.memory);
        usage.memory_bytes = core::group_memory(group.memory, read(group.memory_folder / files.memory),
                                                read(group.memory_folder / "memory.stat"));
        usage.memory_kills = core::group_memory_kills(read(group.memory_folder / files.memory_events));
    }
    if (group.processes > 0) {
        usage.processes = core::group_processes(read(group.process_folder / "pids.current"));
        usage.refused_forks = core::group_refused_forks(read(group.process_folder / "pids.events"));
    }
    if (group.processors > 0) {
        auto const text = read(group.processor_folder / core::usage_files(group.processors).processors);
        usage.processor = std::chrono::microseconds(core::group_processor_time(group.processors, text));
    }
    return usage;
}

void ControlGroups::remove(Group const& group)
{
    std::lock_guard const lock(mutex_);
    left_.insert(left_.end(), group.folders.begin(), group.folders.end());
    remove_removable();
}

void ControlGroups::remove_removable()
{
    std::erase_if(left_,
                  [](fs::path const& folder) { return ::rmdir(folder.c_str()) == 0 || errno != EBUSY; });
}

std::shared_ptr<ControlGroups> make_control_groups(ControlGroupsParams const& params)
{
    return std::make_shared<ControlGroups>(params);
}

LimitSupport limit_support(ControlGroups const& groups)
{
    return groups.support();
}

std::vector<std::filesystem::path> control_group_mounts(ControlGroups const& groups)
{
    return groups.mounts();
}

} // namespace webots_cloud
