#include "pid_namespace.hpp"

#include <fcntl.h>
#include <linux/sched.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>

namespace webots_cloud::guard {
namespace {

bool write_file(char const* path, char const* text)
{
    int const file = open(path, O_WRONLY | O_CLOEXEC);
    if (file < 0)
        return false;
    auto const size = static_cast<ssize_t>(std::strlen(text));
    bool const written = write(file, text, static_cast<std::size_t>(size)) == size;
    close(file);
    return written;
}

/// In a new user namespace: makes us known there under the numbers that we have outside.
bool map_ourselves(uid_t user, gid_t group)
{
    char users[64];
    char groups[64];
    std::snprintf(users, sizeof users, "%u %u 1", user, user);
    std::snprintf(groups, sizeof groups, "%u %u 1", group, group);
    return write_file("/proc/self/uid_map", users) && write_file("/proc/self/setgroups", "deny") &&
           write_file("/proc/self/gid_map", groups);
}

/// Forks; the child gets the number `wanted` if possible.
pid_t fork_as(pid_t wanted)
{
    clone_args arguments{};
    arguments.exit_signal = SIGCHLD;
    arguments.set_tid = reinterpret_cast<std::uintptr_t>(&wanted);
    arguments.set_tid_size = 1;
    auto const child = static_cast<pid_t>(syscall(SYS_clone3, &arguments, sizeof arguments));
    return child >= 0 ? child : fork();
}

/// Waits for the program, and for whatever falls to us, until the program has ended.
int reap_until_end(pid_t program, sigset_t const& watched)
{
    for (;;) {
        siginfo_t signal{};
        sigwaitinfo(&watched, &signal);
        if (signal.si_signo == SIGTERM)
            kill(program, SIGTERM);
        int status = 0;
        for (pid_t ended = 0; (ended = waitpid(-1, &status, WNOHANG)) > 0;)
            if (ended == program)
                return status;
    }
}

/// The first process of the namespace. `report` is how the guard hears from us; its other end closes when the
/// guard dies.
[[noreturn]] void be_first(char** argv, sigset_t const& signals, Become become, int report, pid_t number)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    pollfd guard{report, 0, 0};
    if (poll(&guard, 1, 0) != 0) // it died before the line above
        _exit(1);
    sigset_t watched;
    sigemptyset(&watched);
    sigaddset(&watched, SIGCHLD);
    sigaddset(&watched, SIGTERM);
    sigprocmask(SIG_SETMASK, &watched, nullptr);
    int const nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO); // the leash is the guard's
    pid_t const program = fork_as(number);
    if (program == 0)
        become(argv, signals);
    bool const told = program > 0 && write(report, "", 1) == 1;
    int const status = told ? reap_until_end(program, watched) : 0;
    _exit(told && write(report, &status, sizeof status) == static_cast<ssize_t>(sizeof status) ? 0 : 1);
}

} // namespace

Started start_in_namespace(char** argv, sigset_t const& signals, Become become)
{
    Started started;
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return started;
    bool const privileged = geteuid() == 0;
    auto const user = geteuid();
    auto const group = getegid();
    auto const number = getpid();
    auto const flags = static_cast<unsigned long>(CLONE_NEWPID | (privileged ? 0 : CLONE_NEWUSER) | SIGCHLD);
    auto const child = static_cast<pid_t>(syscall(SYS_clone, flags, nullptr, nullptr, nullptr, nullptr));
    if (child == 0) {
        close(ends[0]);
        if (privileged || map_ourselves(user, group))
            be_first(argv, signals, become, ends[1], number);
        _exit(1);
    }
    close(ends[1]);
    char byte = 0;
    ssize_t size = -1;
    while (child > 0 && (size = read(ends[0], &byte, 1)) < 0 && errno == EINTR)
        continue;
    if (child > 0 && size == 1) {
        started.process = child;
        started.report = ends[0];
        return started;
    }
    if (child > 0) {
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
    }
    close(ends[0]);
    return started;
}

} // namespace webots_cloud::guard
