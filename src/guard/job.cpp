// A guard on a node of a cluster has no socket to the server, only its own output. It prints where the
// program listens and what it uses, each line with a word that the program can't know; core/slurm/job_output
// reads them.
#include "job.hpp"

#include "clock.hpp"
#include "folders.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace webots_cloud::guard {
namespace {

// Of one look: simulators listen near the root of the tree.
constexpr int max_listening = 64;
constexpr int max_sockets = 64;
constexpr int max_processes = 4096; // whose use is counted

// In milliseconds:
constexpr int port_interval = 200;
constexpr int progress_interval = 500;
constexpr int usage_interval = 1000;

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

/// Adds the children of all threads of a process, up to `max` processes.
int add_children(pid_t process, pid_t* tree, int count, int max)
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
        for (int child = 0; count < max && std::fscanf(children, "%d", &child) == 1;)
            tree[count++] = child;
        std::fclose(children);
    }
    closedir(threads);
    return count;
}

int port_of_tree(pid_t program, ListeningSockets const& sockets)
{
    pid_t tree[max_listening] = {program};
    int count = 1;
    for (int i = 0; i < count; ++i) {
        if (int const port = port_of(tree[i], sockets); port != 0)
            return port;
        count = add_children(tree[i], tree, count, max_listening);
    }
    return 0;
}

/// What a tree uses, as `ProcessUsage` of the server says.
struct Usage
{
    unsigned long long processor_ms = 0;
    unsigned long long bytes = 0;
    unsigned long long own_bytes = 0;
    unsigned long long threads = 0;
    bool is_whole = true;
};

void add_process(pid_t process, Usage& usage)
{
    static unsigned long const tick_ms = 1000UL / static_cast<unsigned long>(sysconf(_SC_CLK_TCK));
    static auto const page = static_cast<unsigned long>(sysconf(_SC_PAGESIZE));
    char path[64];
    char text[1024];
    std::snprintf(path, sizeof path, "/proc/%d/stat", process);
    std::FILE* const status = std::fopen(path, "re");
    if (!status)
        return; // it has ended
    std::size_t const size = std::fread(text, 1, sizeof text - 1, status);
    std::fclose(status);
    text[size] = '\0';
    char const* const name_end = std::strrchr(text, ')'); // the name may hold anything
    unsigned long user = 0;
    unsigned long system = 0;
    unsigned long of_children[2] = {};
    unsigned long threads = 0;
    if (!name_end ||
        std::sscanf(name_end + 1, " %*c %*s %*s %*s %*s %*s %*s %*s %*s %*s %*s %lu %lu %lu %lu %*s %*s %lu",
                    &user, &system, &of_children[0], &of_children[1], &threads) != 5)
        return;
    // Also of children that have ended: in /proc only their parent's file knows of those.
    usage.processor_ms += (user + system + of_children[0] + of_children[1]) * tick_ms;
    usage.threads += threads;
    std::snprintf(path, sizeof path, "/proc/%d/statm", process);
    std::FILE* const memory = std::fopen(path, "re");
    if (!memory)
        return;
    unsigned long resident = 0;
    unsigned long shared = 0;
    if (std::fscanf(memory, "%*s %lu %lu", &resident, &shared) == 2) {
        usage.bytes += resident * page;
        usage.own_bytes += resident > shared ? (resident - shared) * page : 0;
    }
    std::fclose(memory);
}

Usage usage_of_tree(pid_t program)
{
    static pid_t tree[max_processes];
    tree[0] = program;
    int count = 1;
    Usage usage;
    for (int i = 0; i < count; ++i) {
        add_process(tree[i], usage);
        count = add_children(tree[i], tree, count, max_processes);
    }
    usage.is_whole = count < max_processes;
    return usage;
}

/// A tenth of the time of a processor at most.
void measure_folder(Job& job)
{
    auto const began = now_ms();
    if (!job.folder || began < job.measure_due)
        return;
    auto const found = measured(job.folder, ~0ULL);
    job.folder_bytes = found.bytes;
    job.folder_has_too_many = found.too_many;
    auto const ended = now_ms();
    job.measure_due = ended + 9 * (ended - began);
}

void tell_usage(Job& job, pid_t program)
{
    measure_folder(job);
    auto const usage = usage_of_tree(program);
    char line[200];
    std::snprintf(line, sizeof line, "uses %llu %llu %llu %llu %d %llu %d", usage.processor_ms, usage.bytes,
                  usage.own_bytes, usage.threads, usage.is_whole ? 1 : 0, job.folder_bytes,
                  job.folder_has_too_many ? 1 : 0);
    tell(job, line);
}

/// How much the program has read that receives the project.
void tell_received(Job const& job, pid_t program)
{
    char path[64];
    std::snprintf(path, sizeof path, "/proc/%d/io", program);
    std::FILE* const file = std::fopen(path, "re");
    unsigned long long bytes = 0;
    if (!file || std::fscanf(file, "rchar: %llu", &bytes) != 1)
        bytes = 0;
    if (file)
        std::fclose(file);
    char line[60];
    std::snprintf(line, sizeof line, "receives %llu", bytes);
    tell(job, line);
}

/// Prints the lowest port that a process of the tree below `program` listens on. 0: any process may.
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
    job.told = tell(job, line);
}

} // namespace

bool tell(Job const& job, char const* what)
{
    char line[300];
    auto const size = std::snprintf(line, sizeof line, "webots-process-guard %s %s\n", job.word, what);
    return write(STDERR_FILENO, line, static_cast<std::size_t>(size)) == size;
}

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
    if (argc > 2 && std::strcmp(argv[0], "--receive") == 0) {
        job.folder = argv[1];
        job.directory = argv[2];
        argc -= 3;
        argv += 3;
    }
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
    char const* const number = std::getenv("SLURM_JOB_ID");
    std::printf("webots-process-guard %s runs on %s in %s\n", job.word, node && *node ? node : name,
                number && *number ? number : "0");
    std::fflush(stdout);
    fcntl(STDERR_FILENO, F_SETFL, fcntl(STDERR_FILENO, F_GETFL) | O_NONBLOCK);
}

int tell_news(Job& job, pid_t program, bool has_own_network)
{
    if (job.receives) {
        tell_received(job, program);
        return progress_interval;
    }
    if (!job.told)
        tell_port(job, has_own_network ? 0 : program);
    auto const now = now_ms();
    if (now >= job.usage_due && program > 0) {
        tell_usage(job, program);
        job.usage_due = now + usage_interval;
    }
    auto const left = static_cast<int>(job.usage_due - now);
    return job.told || left < port_interval ? left : port_interval;
}

} // namespace webots_cloud::guard
