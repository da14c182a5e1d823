// Makes the namespaces of a program, as many as the kernel allows, and starts it there below a first process
// that reaps orphans, and takes all others with it when it dies. What has worked is reported to the server.
#include "pid_namespace.hpp"

#include "descriptor.hpp"
#include "display.hpp"

#include <fcntl.h>
#include <linux/sched.h>
#include <poll.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/statvfs.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>

namespace webots_cloud::guard {
namespace {

// What the first process of a namespace reports once the program runs: the sum of these flags.
constexpr char is_running = 1;
constexpr char has_own_proc = 2;
constexpr char has_read_only = 4;
constexpr char has_own_displays = 8;
constexpr int failure_shift = 3;                             // of a `NetworkFailure`, where nothing runs
constexpr char const* own_files_limit = "size=16m,mode=755"; // firejail's are some kilobytes

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

/// In a new user namespace: maps our user and group to the same numbers as outside.
bool map_user_and_group(uid_t user, gid_t group)
{
    int const dumpable = prctl(PR_GET_DUMPABLE);
    prctl(PR_SET_DUMPABLE, 1); // otherwise these files belong to root
    char users[64];
    char groups[64];
    std::snprintf(users, sizeof users, "%u %u 1", user, user);
    std::snprintf(groups, sizeof groups, "%u %u 1", group, group);
    bool const mapped = write_file("/proc/self/uid_map", users) &&
                        write_file("/proc/self/setgroups", "deny") &&
                        write_file("/proc/self/gid_map", groups);
    prctl(PR_SET_DUMPABLE, dumpable);
    return mapped;
}

/// The options of a mount that must be kept when a user namespace mounts it again.
unsigned long options_of(char const* folder)
{
    struct statvfs status
    {};
    if (statvfs(folder, &status) != 0)
        return 0;
    unsigned long options = 0;
    options |= (status.f_flag & ST_NOSUID) != 0 ? MS_NOSUID : 0;
    options |= (status.f_flag & ST_NODEV) != 0 ? MS_NODEV : 0;
    options |= (status.f_flag & ST_NOEXEC) != 0 ? MS_NOEXEC : 0;
    options |= (status.f_flag & ST_NOATIME) != 0 ? MS_NOATIME : 0;
    options |= (status.f_flag & ST_NODIRATIME) != 0 ? MS_NODIRATIME : 0;
    options |= (status.f_flag & ST_RELATIME) != 0 ? MS_RELATIME : 0;
    return options;
}

bool make_read_only(char const* folder)
{
    return mount(folder, folder, nullptr, MS_BIND, nullptr) == 0 &&
           mount(nullptr, folder, nullptr, MS_REMOUNT | MS_BIND | MS_RDONLY | options_of(folder), nullptr) ==
               0;
}

/// For a program that makes a sandbox itself, in a new mount namespace. False: it must not run.
bool hide_files_of_others(char const* folder)
{
    return mount(nullptr, "/", nullptr, MS_REC | MS_SLAVE, nullptr) == 0 &&
           mount("tmpfs", folder, "tmpfs", MS_NOSUID | MS_NODEV, own_files_limit) == 0;
}

/// In a new mount namespace.   Returns: the flags of what has worked.
char set_up_mounts(Program const& program)
{
    if (program.own_sandbox) { // it shows nothing of these folders, and mounts a /proc of its own
        bool const displays = program.own_displays && make_display_folder();
        return static_cast<char>(has_read_only | has_own_proc | (displays ? has_own_displays : 0));
    }
    if (mount(nullptr, "/", nullptr, MS_REC | MS_SLAVE, nullptr) != 0) // what we mount is visible to us only
        return 0;
    bool read_only = true;
    for (int i = 0; i < program.read_only_count; ++i)
        read_only =
            (program.user.is_other ? hide(program.read_only[i]) : make_read_only(program.read_only[i])) &&
            read_only;
    if (program.user.is_other && !show_to(program.user))
        _exit(1);
    bool const displays = program.own_displays && make_display_folder();
    bool const proc = mount("proc", "/proc", "proc", MS_NOSUID | MS_NODEV | MS_NOEXEC, nullptr) == 0;
    return static_cast<char>((read_only ? has_read_only : 0) | (displays ? has_own_displays : 0) |
                             (proc ? has_own_proc : 0));
}

/// Forks; the child gets the process number `wanted` if possible.
pid_t fork_with_number(pid_t wanted)
{
    clone_args arguments{};
    arguments.exit_signal = SIGCHLD;
    arguments.set_tid = reinterpret_cast<std::uintptr_t>(&wanted);
    arguments.set_tid_size = 1;
    auto const child = static_cast<pid_t>(syscall(SYS_clone3, &arguments, sizeof arguments));
    return child >= 0 ? child : fork();
}

/// Nobody can reach the program any more.
void end_without_relay(pid_t program)
{
    std::printf("webots-process-guard: the process that leads to the program's port has been killed, so the "
                "program ends\n");
    std::fflush(stdout);
    kill(program, SIGKILL);
}

/// Reaps the program and the orphans that become our children, until the program has ended; it ends with its
/// `relay` (-1: it has none).
int reap_until_end(pid_t program, pid_t relay, int end_signal, sigset_t const& watched)
{
    for (;;) {
        siginfo_t signal{};
        sigwaitinfo(&watched, &signal);
        if (signal.si_signo == SIGTERM)
            kill(program, end_signal);
        int status = 0;
        for (pid_t ended = 0; (ended = waitpid(-1, &status, WNOHANG)) > 0;) {
            if (ended == program)
                return status;
            if (ended == relay)
                end_without_relay(program);
        }
    }
}

/// Ends the calling process with the guard, even if that has died already. `report` is a pipe to the guard,
/// whose other end closes then.
void die_with_guard(int report)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    pollfd guard{report, 0, 0};
    if (poll(&guard, 1, 0) != 0) // it died before the call above
        _exit(1);
}

/// Runs as the first process of the namespace.
[[noreturn]] void run_as_first_process(Program const& argument, Execute execute, pid_t relay, int report,
                                       pid_t number, char mounts)
{
    die_with_guard(report); // again: the kernel forgets it when a process gets other rights
    if (argument.own_displays && (mounts & has_own_displays) == 0)
        _exit(1);
    // Blocked before there is a child, so that none ends unheard; the program gets its own mask back.
    sigset_t watched;
    sigemptyset(&watched);
    sigaddset(&watched, SIGCHLD);
    sigaddset(&watched, SIGTERM);
    sigprocmask(SIG_SETMASK, &watched, nullptr);
    int const nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO); // the control socket is for the guard only
    pid_t const program = fork_with_number(number);
    if (program == 0)
        execute(argument);
    char const working = static_cast<char>(is_running | mounts);
    bool const reported = program > 0 && write(report, &working, 1) == 1;
    int const status = reported ? reap_until_end(program, relay, argument.end_signal, watched) : 0;
    _exit(reported && write(report, &status, sizeof status) == static_cast<ssize_t>(sizeof status) ? 0 : 1);
}

[[noreturn]] void report_failure(int report, NetworkFailure failure)
{
    char const word = static_cast<char>(static_cast<int>(failure) << failure_shift);
    _exit(write(report, &word, 1) == 1 ? 1 : 2);
}

/// Tries one combination of namespaces, `flags`.
Started try_to_start(Program const& program, Execute execute, unsigned long flags)
{
    Started started;
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
        started.error = errno;
        return started;
    }
    // Of the guard, as they are outside: the child, in new namespaces, can't know them any more.
    auto const user = geteuid();
    auto const group = getegid();
    auto const number = getpid();
    NetworkSetup network(program.network);
    if (!network.prepare()) {
        started.error = errno;
        close(ends[0]);
        close(ends[1]);
        return started;
    }
    if (program.network.is_own())
        flags |= CLONE_NEWNET;
    // The system call itself, as `fork` has no flags: with a null stack it goes on in a copy of this process.
    auto const child =
        static_cast<pid_t>(syscall(SYS_clone, flags | SIGCHLD, nullptr, nullptr, nullptr, nullptr));
    started.error = child < 0 ? errno : EPERM;
    if (child == 0) {
        close(ends[0]);
        die_with_guard(ends[1]); // first of all: what follows may wait for the guard
        if ((flags & CLONE_NEWUSER) != 0 && !map_user_and_group(user, group))
            _exit(1);
        if (auto const failure = network.complete_inside(); failure != NetworkFailure::nothing)
            report_failure(ends[1], failure);
        if (program.own_sandbox && !hide_files_of_others(program.own_sandbox))
            _exit(1);
        run_as_first_process(program, execute, network.relay(), ends[1], number,
                             (flags & CLONE_NEWNS) != 0 ? set_up_mounts(program) : '\0');
    }
    close(ends[1]);
    char working = 0;
    ssize_t size = -1;
    // The child can't do all by itself: what it needs from outside is done while it waits. Its first word
    // says what came of it.
    if (child > 0) {
        network.complete_outside(child);
        await_word_of(child, ends[0]);
        size = read(ends[0], &working, 1);
    }
    if (child > 0 && size == 1 && (working & is_running) != 0) {
        started.process = child;
        started.report = ends[0];
        started.listening = network.take_report();
        started.own_proc = (working & has_own_proc) != 0;
        started.read_only = (working & has_read_only) != 0;
        started.error = 0;
        return started;
    }
    if (size == 1)
        started.network_failure = static_cast<NetworkFailure>(working >> failure_shift);
    // It does not run as it was to: nothing of it may be left before the next combination is tried.
    if (child > 0) {
        kill(child, SIGKILL);
        waitpid(child, nullptr, 0);
    }
    close(ends[0]);
    return started;
}

} // namespace

Started start_in_namespace(Program const& program, Execute execute)
{
    constexpr unsigned long plain = CLONE_NEWPID;
    constexpr unsigned long with_mounts = CLONE_NEWPID | CLONE_NEWNS;
    constexpr unsigned long user = CLONE_NEWUSER;
    Started started;
    started.error = EPERM;
    if (program.own_sandbox)
        return geteuid() == 0 ? try_to_start(program, execute, CLONE_NEWNS) : started;
    if (geteuid() == 0)
        for (auto const flags : {with_mounts, plain})
            if ((started = try_to_start(program, execute, flags)).process > 0)
                return started;
    if (program.set_user_id || program.user.is_other) // neither is possible in a user namespace
        return started;
    for (auto const flags : {user | with_mounts, user | plain})
        if ((started = try_to_start(program, execute, flags)).process > 0)
            return started;
    return started;
}

} // namespace webots_cloud::guard
