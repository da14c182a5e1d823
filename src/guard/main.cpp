// webots-process-guard: runs one program and makes sure that nothing it started outlives it, or the one who
// asked for it.
//
//     webots-process-guard [--afterwards COUNT WORD...] [--set-user-id] [--read-only FOLDER]... GRACE_MS
//     PROGRAM [ARGUMENT...] webots-process-guard --probe [--read-only FOLDER]...
//
// Standard input is the leash: a byte on it asks the program to end (SIGTERM, and SIGKILL for the whole tree
// after GRACE_MS milliseconds); its end of file, which also comes when the owner dies in whatever way, kills
// the tree at once. The owner gives a socket, which nobody can open again by its name in /proc and so hold
// open; and should somebody get hold of it all the same, the death of our parent, who is the owner, counts as
// its end. Processes that leave their parents (fork twice, setsid) fall to the guard, which is their
// sub-reaper, so none is missed and no name is ever looked up. The guard ends only when no process of the
// tree is left, in the same way as the program did.
//
// COUNT words after --afterwards are the command line of a program that clears away what the tree leaves
// elsewhere (containers, for instance, whose processes are not of the tree). It runs when the tree is gone,
// and for a minute at most.
//
// Where the kernel allows it the tree lives in a PID namespace of its own. Then it dies even when somebody
// kills the guard, and no process of it can signal the guard, the server or another simulation. Who is not
// root needs a user namespace for that, in which set-user-ID programs are programs like any other; with
// --set-user-id the tree goes without. A mount namespace comes with it where that is allowed too: /proc shows
// the tree alone, and the folders after --read-only can't be changed. Root's programs lose the capabilities
// that would lead out of there, but not with --set-user-id. Where there is no PID namespace, Landlock forbids
// signals to others, if the kernel has it (Linux 6.12).
//
// --probe says in one line which of this works here: "namespace", "signals" (Landlock) or "none", followed by
// "proc" and "read-only" where they do, or by ": " and the reason why there is no namespace.
//
// Nobody may trace us or look into our memory and descriptors (PR_SET_DUMPABLE), but root; see
// `forbid_tracing`.
//
// Plain system calls and nothing of the library: it runs once per simulation, and its few pages are all that
// each one costs.

#include "pid_namespace.hpp"
#include "privileges.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <initializer_list>

namespace {

using webots_cloud::guard::Program;
using webots_cloud::guard::Started;

constexpr int exec_failed = 127; // as shells and coreutils have it
constexpr long max_cleanup_ms = 60'000;

long now_ms()
{
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1000 + time.tv_nsec / 1'000'000;
}

/// In the child: becomes the program.
[[noreturn]] void become(Program const& program)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL); // should somebody kill the guard itself
    setpgid(0, 0);
    sigprocmask(SIG_SETMASK, &program.signals, nullptr);
    int const nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO);
    execv(program.argv[0], program.argv);
    std::printf("can't run %s: %s\n", program.argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

/// The same, for what strangers have made.
[[noreturn]] void become_confined(Program const& program)
{
    if (!program.set_user_id)
        webots_cloud::guard::drop_capabilities();
    become(program);
}

/// The same where there is no PID namespace.
[[noreturn]] void become_confined_here(Program const& program)
{
    if (!program.set_user_id)
        webots_cloud::guard::confine_signals();
    become_confined(program);
}

/// For a probe.
[[noreturn]] void become_nothing(Program const&)
{
    _exit(0);
}

/// Sends SIGKILL to every child. Their children become ours as they die, and are met in the next round.
void kill_children()
{
    char path[64];
    std::snprintf(path, sizeof path, "/proc/self/task/%d/children", getpid());
    std::FILE* const children = std::fopen(path, "re");
    if (!children)
        return;
    for (int child = 0; std::fscanf(children, "%d", &child) == 1;)
        kill(child, SIGKILL);
    std::fclose(children);
}

class Guard
{
public:
    /// `owner`: a pidfd, or -1.
    Guard(Started started, long grace_ms, int owner)
        : program_(started.process), report_(started.report), grace_ms_(grace_ms), owner_(owner)
    {}

    /// Of a program that nobody asks to end, and that has so much time.
    static Guard of_unasked(pid_t program, long time_ms)
    {
        Started started;
        started.process = program;
        Guard guard(started, 0, -1);
        guard.kill_at_ = now_ms() + time_ms;
        guard.leash_open_ = false;
        return guard;
    }

    /// Returns the status of the program when no process is left.
    int watch(int signals);

private:
    void read_leash();
    void reap();
    void terminate();
    int wait_time() const;

    pid_t program_;
    int report_;
    long grace_ms_;
    int owner_;         ///< -1: is not watched, or has died.
    long kill_at_ = -1; ///< When patience ends; -1: nobody has asked for an end.
    int status_ = 0;
    bool killing_ = false;
    bool leash_open_ = true;
    bool alone_ = false;
};

void Guard::terminate()
{
    if (kill_at_ >= 0)
        return;
    kill_at_ = now_ms() + grace_ms_;
    if (program_ > 0)
        kill(program_, SIGTERM);
}

void Guard::read_leash()
{
    char bytes[16];
    ssize_t const size = read(STDIN_FILENO, bytes, sizeof bytes);
    if (size > 0)
        terminate();
    else if (size == 0 || (errno != EINTR && errno != EAGAIN)) {
        leash_open_ = false;
        killing_ = true;
    }
}

void Guard::reap()
{
    int status = 0;
    pid_t ended = 0;
    while ((ended = waitpid(-1, &status, WNOHANG)) > 0) {
        if (ended != program_)
            continue;
        int reported = 0;
        bool const has_report = report_ >= 0 && read(report_, &reported, sizeof reported) ==
                                                    static_cast<ssize_t>(sizeof reported);
        status_ = has_report ? reported : status;
        program_ = -1;
        killing_ = true; // what the program leaves behind has nobody to serve any more
    }
    alone_ = ended < 0 && errno == ECHILD;
}

int Guard::wait_time() const
{
    if (killing_)
        return 10; // children of the killed fall to us one by one
    if (kill_at_ < 0)
        return -1;
    long const left = kill_at_ - now_ms();
    return left > 0 ? static_cast<int>(left) : 0;
}

int Guard::watch(int signals)
{
    for (;;) {
        reap();
        if (alone_)
            return status_;
        if (kill_at_ >= 0 && now_ms() >= kill_at_)
            killing_ = true;
        if (killing_)
            kill_children();
        pollfd watched[] = {
            {signals, POLLIN, 0}, {leash_open_ ? STDIN_FILENO : -1, POLLIN, 0}, {owner_, POLLIN, 0}};
        if (poll(watched, 3, wait_time()) <= 0)
            continue;
        if (watched[1].revents != 0)
            read_leash();
        if (watched[2].revents != 0) {
            owner_ = -1;
            killing_ = true;
        }
        signalfd_siginfo info{};
        if ((watched[0].revents & POLLIN) != 0 &&
            read(signals, &info, sizeof info) == static_cast<ssize_t>(sizeof info) &&
            info.ssi_signo != SIGCHLD)
            terminate();
    }
}

/// Ends like the program did, so that our parent sees what it would have seen.
[[noreturn]] void end_like(int status)
{
    if (WIFSIGNALED(status)) {
        rlimit const no_core{0, 0};
        setrlimit(RLIMIT_CORE, &no_core);
        int const number = WTERMSIG(status);
        std::signal(number, SIG_DFL);
        sigset_t one;
        sigemptyset(&one);
        sigaddset(&one, number);
        sigprocmask(SIG_UNBLOCK, &one, nullptr);
        raise(number);
    }
    _exit(WEXITSTATUS(status));
}

/// Clears away what the tree has left. In silence: who would read it may be dead, and a closed pipe ends
/// those who write.
void run_afterwards(char** argv, sigset_t const& original, int signals)
{
    Program command;
    command.argv = argv;
    command.signals = original;
    pid_t const program = fork();
    if (program == 0) {
        int const nobody = open("/dev/null", O_WRONLY);
        dup2(nobody, STDOUT_FILENO);
        dup2(nobody, STDERR_FILENO);
        become(command);
    }
    if (program > 0)
        Guard::of_unasked(program, max_cleanup_ms).watch(signals);
}

/// Takes the command line after `--afterwards` out of ours: `argv` then begins with GRACE_MS. Null: there is
/// none.
char** take_afterwards(int& argc, char**& argv)
{
    --argc;
    ++argv;
    if (argc < 2 || std::strcmp(argv[0], "--afterwards") != 0)
        return nullptr;
    int const count = std::atoi(argv[1]);
    if (count < 1 || count > argc - 2)
        return nullptr;
    for (int i = 0; i < count; ++i)
        argv[i] = argv[i + 2];
    argv[count] = nullptr; // where COUNT was, or a word that has moved
    char** const cleanup_command = argv;
    argc -= count + 2;
    argv += count + 2;
    return cleanup_command;
}

/// Takes a word out of our command line; whether it was there.
bool take_word(int& argc, char**& argv, char const* word)
{
    bool const given = argc > 0 && std::strcmp(argv[0], word) == 0;
    argc -= given ? 1 : 0;
    argv += given ? 1 : 0;
    return given;
}

/// Takes the folders that must not be changed. Returns how many they are; they lie where the first
/// `--read-only` was.
int take_read_only(int& argc, char**& argv)
{
    char** const folders = argv;
    int count = 0;
    while (argc > 1 && take_word(argc, argv, "--read-only")) {
        folders[count++] = argv[0];
        --argc;
        ++argv;
    }
    return count;
}

/// The process that has started us, as a descriptor that becomes readable when it ends.
int watch_owner()
{
    auto const owner = getppid(); // 0: in another PID namespace
    return owner > 0 ? static_cast<int>(syscall(SYS_pidfd_open, owner, 0)) : -1;
}

int usage(char const* name)
{
    std::fprintf(stderr,
                 "usage: %s [--afterwards COUNT WORD...] [--set-user-id] [--read-only FOLDER]... GRACE_MS "
                 "PROGRAM [ARGUMENT...]\n"
                 "       %s --probe [--read-only FOLDER]...\n",
                 name, name);
    return 2;
}

/// Says what a program would get.
int probe(Program const& program)
{
    auto const started = webots_cloud::guard::start_in_namespace(program, become_nothing);
    if (started.process > 0) {
        waitpid(started.process, nullptr, 0);
        std::printf("namespace%s%s\n", started.own_proc ? " proc" : "",
                    started.read_only ? " read-only" : "");
    } else {
        std::printf("%s: %s\n", webots_cloud::guard::can_confine_signals() ? "signals" : "none",
                    std::strerror(started.error));
    }
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    webots_cloud::guard::forbid_tracing();
    char const* const name = argv[0];
    char** const cleanup_command = take_afterwards(argc, argv);
    bool const is_probe = take_word(argc, argv, "--probe");
    Program program;
    program.set_user_id = take_word(argc, argv, "--set-user-id");
    program.read_only = argv;
    program.read_only_count = take_read_only(argc, argv);
    program.argv = argv + 1;
    if (argc < 2 && !(is_probe && argc == 0))
        return usage(name);
    setsid(); // the terminal's Ctrl-C is for the server, which then ends its simulations in order
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    prctl(PR_SET_PDEATHSIG, SIGCONT); // should we be stopped when the owner dies: there is a leash to look at
    int const owner = watch_owner();
    sigset_t handled;
    sigemptyset(&handled);
    for (int const number : {SIGCHLD, SIGTERM, SIGINT, SIGHUP})
        sigaddset(&handled, number);
    sigprocmask(SIG_BLOCK, &handled, &program.signals);
    if (is_probe)
        return probe(program);
    int const signals = signalfd(-1, &handled, SFD_CLOEXEC | SFD_NONBLOCK);
    auto started = webots_cloud::guard::start_in_namespace(program, become_confined);
    if (started.process < 0)
        started.process = fork();
    if (started.process == 0)
        become_confined_here(program);
    if (started.process < 0 || signals < 0) {
        std::printf("can't start %s: %s\n", program.argv[0], std::strerror(errno));
        return exec_failed;
    }
    int const status = Guard(started, std::strtol(argv[0], nullptr, 10), owner).watch(signals);
    if (cleanup_command)
        run_afterwards(cleanup_command, program.signals, signals);
    end_like(status);
}
