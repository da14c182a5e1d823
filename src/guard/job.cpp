#include "job.hpp"

#include <dirent.h>
#include <sys/random.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace webots_cloud::guard {
namespace {

// Of one look: simulators listen near the root of the tree.
constexpr int max_processes = 64;
constexpr int max_sockets = 64;

struct ListeningSocket
{
    unsigned long inode;
    int port;
};

struct ListeningSockets
{
    ListeningSocket found[max_sockets];
    int count = 0;
};

/// Adds what listens according to a table of the kernel.
void add_listening(char const* table, Job const& job, ListeningSockets& sockets)
{
    constexpr unsigned listen_state = 0x0A;
    std::FILE* const file = std::fopen(table, "re");
    if (!file)
        return;
    char line[512];
    while (sockets.count < max_sockets && std::fgets(line, sizeof line, file)) {
        unsigned port = 0;
        unsigned state = 0;
        unsigned long inode = 0;
        if (std::sscanf(line, "%*s %*[0-9A-F]:%x %*[0-9A-F]:%*x %x %*s %*s %*s %*s %*s %lu", &port, &state,
                        &inode) != 3 ||
            state != listen_state)
            continue;
        int const number = static_cast<int>(port);
        if (number >= job.first && number <= job.last)
            sockets.found[sockets.count++] = {inode, number};
    }
    std::fclose(file);
}

/// The lowest of these ports that is open in a process; 0: none.
int port_of(pid_t process, ListeningSockets const& sockets)
{
    char path[64];
    std::snprintf(path, sizeof path, "/proc/%d/fd", process);
    DIR* const folder = opendir(path);
    if (!folder)
        return 0;
    int lowest = 0;
    while (dirent const* const entry = readdir(folder)) {
        char target[64];
        ssize_t const size = readlinkat(dirfd(folder), entry->d_name, target, sizeof target - 1);
        if (size <= 0)
            continue;
        target[size] = '\0';
        unsigned long inode = 0;
        if (std::sscanf(target, "socket:[%lu]", &inode) != 1)
            continue;
        for (int i = 0; i < sockets.count; ++i)
            if (sockets.found[i].inode == inode && (lowest == 0 || sockets.found[i].port < lowest))
                lowest = sockets.found[i].port;
    }
    closedir(folder);
    return lowest;
}

/// Adds the children of all threads of a process.
int add_children(pid_t process, pid_t* tree, int count)
{
    char path[300];
    std::snprintf(path, sizeof path, "/proc/%d/task", process);
    DIR* const threads = opendir(path);
    if (!threads)
        return count;
    while (dirent const* const thread = readdir(threads)) {
        if (thread->d_name[0] == '.')
            continue;
        std::snprintf(path, sizeof path, "/proc/%d/task/%s/children", process, thread->d_name);
        std::FILE* const children = std::fopen(path, "re");
        if (!children)
            continue;
        for (int child = 0; count < max_processes && std::fscanf(children, "%d", &child) == 1;)
            tree[count++] = child;
        std::fclose(children);
    }
    closedir(threads);
    return count;
}

int port_of_tree(pid_t program, ListeningSockets const& sockets)
{
    pid_t tree[max_processes] = {program};
    int count = 1;
    for (int i = 0; i < count; ++i) {
        if (int const port = port_of(tree[i], sockets); port != 0)
            return port;
        count = add_children(tree[i], tree, count);
    }
    return 0;
}

void tell(Job const& job, char const* what)
{
    std::printf("webots-process-guard %s %s\n", job.word, what);
    std::fflush(stdout);
}

} // namespace

bool take_job(int& argc, char**& argv, Job& job)
{
    if (argc == 0 || std::strcmp(argv[0], "--job") != 0)
        return true;
    if (argc < 3)
        return false;
    job.first = std::atoi(argv[1]);
    job.last = std::atoi(argv[2]);
    argc -= 3;
    argv += 3;
    return job.first > 0 && job.last >= job.first;
}

void tell_node(Job& job)
{
    unsigned char random[8] = {};
    if (getrandom(random, sizeof random, 0) != static_cast<ssize_t>(sizeof random))
        std::abort(); // it never gives less than 256 bytes
    for (unsigned i = 0; i < sizeof random; ++i)
        std::snprintf(job.word + 2 * i, 3, "%02x", random[i]);
    char name[256] = "";
    (void)gethostname(name, sizeof name - 1);
    char const* const node = std::getenv("SLURMD_NODENAME");
    char line[300];
    std::snprintf(line, sizeof line, "runs on %s", node && *node ? node : name);
    tell(job, line);
}

void tell_port(Job& job, pid_t program)
{
    ListeningSockets sockets;
    add_listening("/proc/self/net/tcp", job, sockets);
    add_listening("/proc/self/net/tcp6", job, sockets);
    int port = 0;
    if (program > 0)
        port = sockets.count > 0 ? port_of_tree(program, sockets) : 0;
    else if (sockets.count > 0)
        port = sockets.found[0].port;
    if (port == 0)
        return;
    char line[40];
    std::snprintf(line, sizeof line, "listens on %d", port);
    tell(job, line);
    job.told = true;
}

} // namespace webots_cloud::guard
