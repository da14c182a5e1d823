#include "limits.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace webots_cloud::guard {
namespace {

unsigned long long* find_limit(Limits& limits, char const* name)
{
    if (std::strcmp(name, "data") == 0)
        return &limits.data;
    if (std::strcmp(name, "processes") == 0)
        return &limits.processes;
    if (std::strcmp(name, "files") == 0)
        return &limits.files;
    return std::strcmp(name, "file-size") == 0 ? &limits.file_size : nullptr;
}

bool add_group(Limits& limits, char const* folder)
{
    for (auto& each : limits.folders)
        if (!each) {
            each = folder;
            return true;
        }
    return false;
}

/// Lowers both the soft and the hard limit, which is never raised.
bool lower(__rlimit_resource resource, unsigned long long wanted)
{
    rlimit limit{};
    if (getrlimit(resource, &limit) != 0)
        return false;
    if (limit.rlim_max > wanted)
        limit.rlim_max = wanted;
    if (limit.rlim_cur > limit.rlim_max || resource == RLIMIT_NOFILE)
        limit.rlim_cur = limit.rlim_max;
    return setrlimit(resource, &limit) == 0;
}

/// Whether we are in a user namespace that was made for this program: it has one user.
bool has_own_user_namespace()
{
    std::FILE* const map = std::fopen("/proc/self/uid_map", "re");
    unsigned long inside = 0;
    unsigned long outside = 0;
    unsigned long count = 0;
    bool const read = map && std::fscanf(map, "%lu %lu %lu", &inside, &outside, &count) == 3;
    if (map)
        std::fclose(map);
    return read && count == 1;
}

/// Since Linux 5.14 the processes of a user are counted in each user namespace by itself.
bool counts_processes_by_namespace()
{
    utsname system{};
    int major = 0;
    int minor = 0;
    return uname(&system) == 0 && std::sscanf(system.release, "%d.%d", &major, &minor) == 2 &&
           (major > 5 || (major == 5 && minor >= 14));
}

/// The list of the members of a group, to be written to. A process of one thread that writes to `tasks` is
/// moved at once; for `cgroup.procs` the kernel first waits until no process of the machine forks or ends,
/// some 10 ms.
int open_members(char const* group, char const* list)
{
    char path[4096];
    std::snprintf(path, sizeof path, "%s/%s", group, list);
    return open(path, O_WRONLY | O_CLOEXEC);
}

} // namespace

bool take_limits(int& argc, char**& argv, Limits& limits)
{
    for (;;) {
        bool const group = argc > 0 && std::strcmp(argv[0], "--group") == 0;
        bool const limit = argc > 0 && std::strcmp(argv[0], "--limit") == 0;
        if (!group && !limit)
            return true;
        int const words = group ? 2 : 3;
        if (argc < words || (group && !add_group(limits, argv[1])))
            return false;
        if (limit) {
            auto* const value = find_limit(limits, argv[1]);
            if (!value)
                return false;
            *value = std::strtoull(argv[2], nullptr, 10);
        }
        argc -= words;
        argv += words;
    }
}

bool open_groups(Limits& limits)
{
    for (int i = 0; i < Limits::max_groups && limits.folders[i]; ++i) {
        limits.groups[i] = open_members(limits.folders[i], "tasks");
        if (limits.groups[i] < 0 && errno == ENOENT) // version 2
            limits.groups[i] = open_members(limits.folders[i], "cgroup.procs");
        if (limits.groups[i] < 0)
            return false;
    }
    return true;
}

bool enter_groups(Limits const& limits)
{
    for (int i = 0; i < Limits::max_groups && limits.folders[i]; ++i)
        if (write(limits.groups[i], "0", 1) != 1) // who writes this is moved
            return false;
    return true;
}

bool set_limits(Limits const& limits)
{
    // A core file would hold the memory of a stranger's program, and can be larger than its disk limit.
    if (!lower(RLIMIT_CORE, 0))
        return false;
    if (limits.data > 0 && !lower(RLIMIT_DATA, limits.data))
        return false;
    if (limits.files > 0 && !lower(RLIMIT_NOFILE, limits.files))
        return false;
    if (limits.file_size > 0 && !lower(RLIMIT_FSIZE, limits.file_size))
        return false;
    if (limits.processes > 0 && has_own_user_namespace() && counts_processes_by_namespace())
        return lower(RLIMIT_NPROC, limits.processes);
    return true;
}

void remove_groups(Limits const& limits)
{
    for (auto const* folder : limits.folders)
        if (folder)
            rmdir(folder);
}

} // namespace webots_cloud::guard
