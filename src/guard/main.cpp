// webots-process-guard: runs one program and makes sure that nothing it started outlives it, or the one who asked for it.
//
//     webots-process-guard [--afterwards COUNT WORD...] [--set-user-id] GRACE_MS PROGRAM [ARGUMENT...]
//
// Standard input is the leash: a byte on it asks the program to end (SIGTERM, and SIGKILL for the whole tree after GRACE_MS
// milliseconds); its end of file, which also comes when the owner dies in whatever way, kills the tree at once. Processes that
// leave their parents (fork twice, setsid) fall to the guard, which is their sub-reaper, so none is missed and no name is ever
// looked up. The guard ends only when no process of the tree is left, in the same way as the program did.
//
// COUNT words after --afterwards are the command line of a program that clears away what the tree leaves elsewhere (containers, for
// instance, whose processes are not of the tree). It runs when the tree is gone, and for a minute at most.
//
// Where the kernel allows it the tree lives in a PID namespace of its own. Then it dies even when somebody kills the guard, and no
// process of it can see the guard, the server or another simulation, let alone signal them. Who is not root needs a user namespace
// for that, in which set-user-ID programs are programs like any other; with --set-user-id the tree goes without.
//
// Plain system calls and nothing of the library: it runs once per simulation, and its few pages are all that each one costs.

#include "pid_namespace.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
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

constexpr int exec_failed = 127; // as shells and coreutils have it
constexpr long longest_afterwards_ms = 60'000;

long now_ms()
{
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return time.tv_sec * 1000 + time.tv_nsec / 1'000'000;
}

/// In the child: becomes the program.
[[noreturn]] void become(char** argv, sigset_t const& signals)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL); // should somebody kill the guard itself
    setpgid(0, 0);
    sigprocmask(SIG_SETMASK, &signals, nullptr);
    int const nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO);
    execv(argv[0], argv);
    std::printf("can't run %s: %s\n", argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
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
    Guard(webots_cloud::guard::Started started, long grace_ms) :
        program_(started.process), report_(started.report), grace_ms_(grace_ms)
    {}

    /// Of a program that nobody asks to end, and that has so much time.
    static Guard of_unasked(pid_t program, long time_ms)
    {
        webots_cloud::guard::Started started;
        started.process = program;
        Guard guard(started, 0);
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
        bool const has_report = report_ >= 0 && read(report_, &reported, sizeof reported) == static_cast<ssize_t>(sizeof reported);
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
        pollfd watched[] = {{signals, POLLIN, 0}, {leash_open_ ? STDIN_FILENO : -1, POLLIN, 0}};
        if (poll(watched, 2, wait_time()) <= 0)
            continue;
        if (watched[1].revents != 0)
            read_leash();
        signalfd_siginfo info{};
        if ((watched[0].revents & POLLIN) != 0 && read(signals, &info, sizeof info) == static_cast<ssize_t>(sizeof info) &&
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

/// Clears away what the tree has left. In silence: who would read it may be dead, and a closed pipe ends those who write.
void run_afterwards(char** argv, sigset_t const& original, int signals)
{
    pid_t const program = fork();
    if (program == 0) {
        int const nobody = open("/dev/null", O_WRONLY);
        dup2(nobody, STDOUT_FILENO);
        dup2(nobody, STDERR_FILENO);
        become(argv, original);
    }
    if (program > 0)
        Guard::of_unasked(program, longest_afterwards_ms).watch(signals);
}

/// Takes the command line after `--afterwards` out of ours: `argv` then begins with GRACE_MS. Null: there is none.
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
    char** const afterwards = argv;
    argc -= count + 2;
    argv += count + 2;
    return afterwards;
}

/// Takes `--set-user-id` out of our command line; whether it was there.
bool take_set_user_id(int& argc, char**& argv)
{
    bool const given = argc > 0 && std::strcmp(argv[0], "--set-user-id") == 0;
    argc -= given ? 1 : 0;
    argv += given ? 1 : 0;
    return given;
}

} // namespace

int main(int argc, char** argv)
{
    char const* const name = argv[0];
    char** const afterwards = take_afterwards(argc, argv);
    bool const set_user_id = take_set_user_id(argc, argv);
    if (argc < 2) {
        std::fprintf(stderr, "usage: %s [--afterwards COUNT WORD...] [--set-user-id] GRACE_MS PROGRAM [ARGUMENT...]\n", name);
        return 2;
    }
    setsid(); // the terminal's Ctrl-C is for the server, which then ends its simulations in order
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    prctl(PR_SET_PDEATHSIG, SIGCONT); // should we be stopped when the owner dies: there is a leash to look at
    sigset_t handled;
    sigset_t original;
    sigemptyset(&handled);
    for (int const number : {SIGCHLD, SIGTERM, SIGINT, SIGHUP})
        sigaddset(&handled, number);
    sigprocmask(SIG_BLOCK, &handled, &original);
    int const signals = signalfd(-1, &handled, SFD_CLOEXEC | SFD_NONBLOCK);
    webots_cloud::guard::Started started;
    if (!set_user_id || geteuid() == 0)
        started = webots_cloud::guard::start_in_namespace(argv + 1, original, become);
    if (started.process < 0)
        started.process = fork();
    if (started.process == 0)
        become(argv + 1, original);
    if (started.process < 0 || signals < 0) {
        std::printf("can't start %s: %s\n", argv[1], std::strerror(errno));
        return exec_failed;
    }
    int const status = Guard(started, std::strtol(argv[0], nullptr, 10)).watch(signals);
    if (afterwards)
        run_afterwards(afterwards, original, signals);
    end_like(status);
}
