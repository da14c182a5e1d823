// webots-process-guard: runs one program and makes sure that no process it started outlives it, or outlives
// the server that asked for it.
//
//     webots-process-guard [--cleanup COUNT WORD...] [--job FIRST LAST [--receive FOLDER DIRECTORY]]
//                          [--subordinate] [--send COUNT PATH...] [--set-user-id]
//                          [--network none PORT | --network internet PORT SLIRP IP RULES] [--broker SOCKET]
//                          [--group FOLDER]... [--limit NAME NUMBER]...
//                          [--container DOCKER LABEL] [--own-sandbox FOLDER] [--own-displays]
//                          [--open NUMBER FILE]...
//                          [--user UID GID[,GID...] FOLDER HOME AUTHORITY [--visible PATH]...]
//                          [--read-only FOLDER]... GRACE_MS PROGRAM [ARGUMENT...]
//     webots-process-guard --display SERVER LIMIT_MS [PROGRAM [ARGUMENT...]]
//     webots-process-guard --probe [--read-only FOLDER]...
//     webots-process-guard --filter PROGRAM [ARGUMENT...]
//     webots-process-guard --try FILE PORT PROCESS
//     webots-process-guard --make-users NEWUIDMAP NEWGIDMAP FIRST_USER FIRST_GROUP COUNT
//     webots-process-guard --pin-users FOLDER | --unpin-users FOLDER
//     webots-process-guard --subordinate --take-back FOLDER | --measure FOLDER ENOUGH | --put FROM TO FILE
//     webots-process-guard --put FROM TO FILE
//
// Standard input is the control socket. A byte asks the program to end: it gets SIGTERM, and the whole tree
// SIGKILL after GRACE_MS milliseconds. End-of-file, which also arrives when the server dies for whatever
// reason, kills the tree at once. The server passes a socket because a pipe could be opened again by its name
// in /proc, and so be kept open by somebody else. In case somebody gets hold of the socket all the same, the
// guard also watches its parent, the server, and treats its death as end-of-file. The guard writes to it too:
// "L" once, as soon as the port of a program with a network of its own is reached. The guard is the child
// subreaper of the tree: processes that leave their parents (fork twice, setsid) become its children, so that
// it finds all of them without looking up any names. It exits only when no process of the tree is left, with
// the status of the program.
//
// The COUNT words after --cleanup are the command line of a program that removes what the tree leaves behind
// elsewhere (containers, for instance, whose processes are not part of the tree). It is run when no process
// of the tree is left, for a minute at most.
//
// --job: we run on a node of a cluster, started by its scheduler, and there is no control socket: SIGTERM
// asks the program to end, and the scheduler's process that has started us is our owner. Before the program
// starts we print a line with a random word that it can't know, the node, and the number of the job. With the
// same word we print to standard error, which the program does not get, the TCP port from FIRST to LAST that
// it listens on, once it does, and every second what it uses: the time of processors in milliseconds, bytes
// in memory, those of them that no file is behind, threads, 1 if that is all, bytes in FOLDER, and 1 if there
// are too many files:
//     webots-process-guard 5f0c9a4b7d21e836 runs on node7 in 4711
//     webots-process-guard 5f0c9a4b7d21e836 listens on 2001
//     webots-process-guard 5f0c9a4b7d21e836 uses 12040 210763776 104857600 31 1 4096 0
//
// --send gives the program files and folders as standard input, packed by `tar`, and asks it to end by
// SIGUSR1, which it passes on. --receive, on the node, unpacks them into FOLDER before the program starts, in
// DIRECTORY. FOLDER is made, and removed when no process is left; if we are killed, by the next guard that
// makes a folder beside it.
//
// Where the kernel allows it, the tree runs in a PID namespace of its own. Then it dies even when somebody
// kills the guard, and no process of it can signal the guard, the server or another simulation. Users other
// than root need a user namespace for that, in which set-user-ID programs gain no privileges; with
// --set-user-id the tree runs without one. A mount namespace is added where that is allowed too: /proc shows
// only the tree, and the folders after --read-only can't be changed. Programs of root lose the capabilities
// with which they could leave the namespaces, unless --set-user-id is given. Where there is no PID namespace,
// Landlock forbids signals to other processes, if the kernel supports that (Linux 6.12).
//
// --network gives the tree a network of its own: with "none" it reaches nothing, with "internet" what
// slirp4netns (SLIRP) passes on and the lines of the file RULES, executed by `ip -batch` (IP) in that
// network, do not forbid. Connections to PORT of the machine are relayed to the same port in there, once
// somebody listens on it. With --broker no port of the machine is opened: whoever connects to the Unix socket
// SOCKET, which the guard makes and removes, is sent a socket that is connected to PORT in there. If the
// network can't be made, the program is not started.
//
// --container: the program is compose, which has Docker start a container without a network that alone has
// the LABEL, KEY=VALUE. The network is that container's: see container_network.hpp. The tree gets no
// namespaces, since Docker numbers processes as the machine does. Needs root.
//
// --group names a control group, made by the server, that the tree runs in, and --limit what each of its
// processes may use at most: "data" and "file-size" (bytes), "files" (open), and "processes", of the whole
// tree, which has no effect without a user namespace. If any of it can't be set, the program is not started.
// When the server is gone the guard removes the groups.
//
// --own-sandbox: the program is a sandbox with a PID namespace and privileges of its own (firejail), which
// has to see the processes of the machine while it makes that. The tree gets mount and network namespaces
// alone, in which FOLDER, where the program keeps its files, is empty and in memory. Without them, and for
// users other than root, the program is not started.
//
// --own-displays hides the sockets of the machine's X servers from the tree, and those of the tree from the
// machine. If that is not possible, the program is not started. --display, run in such a tree or in a
// sandbox, starts an X server (Xvfb), and runs the program on it, or only tries it: see display.hpp.
//
// --open: the program gets FILE open for reading as its descriptor NUMBER, or an empty file.
//
// --user runs the program as another user, which only root can do: FOLDER becomes that user's, with a folder
// HOME in it and a copy of the file AUTHORITY, and so the program can neither signal the guard and its server
// nor read their files. PATHs are reached even below folders of root's. With an empty FOLDER nothing
// changes hands: the program runs beside one of the same user. See user.hpp.
//
// --subordinate: we enter the user namespace whose descriptor we get as number 3, are root in there, and do
// as root does. --make-users makes that namespace and sends its descriptor over the socket: see
// subordinate.hpp. The users in it are numbers of /etc/subuid, so that a server that is not root has other
// users, too. --pin-users, run by root before a service starts whose user may not do that, makes such a
// namespace for it, and pins it to a file, which --unpin-users removes. What became theirs is taken back when
// no process of the tree is left. With the other options the guard only does one thing in the folder of such
// a user: see folders.hpp.
//
// --filter, run in a sandbox, runs a program without some system calls: see system_calls.hpp.
//
// --try, run in a sandbox, prints what is possible there that should not be: see attempts.hpp.
//
// --probe prints in one line which of this works here: "namespace", "signals" (Landlock) or "none", followed
// by "proc" and "read-only" where they work, or by ": " and the reason why there is no namespace.
//
// Only root may trace the guard, or look into its memory and descriptors (PR_SET_DUMPABLE); see
// `forbid_tracing`.
//
// It uses plain system calls and nothing of the library: one guard runs for each simulation, and should cost
// only a few pages of memory.

#include "attempts.hpp"
#include "clock.hpp"
#include "container_network.hpp"
#include "display.hpp"
#include "exit_status.hpp"
#include "folders.hpp"
#include "job.hpp"
#include "job_folder.hpp"
#include "options.hpp"
#include "pid_namespace.hpp"
#include "privileges.hpp"
#include "subordinate.hpp"
#include "system_calls.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

namespace {

using webots_cloud::guard::exec_failed;
using webots_cloud::guard::NetworkFailure;
using webots_cloud::guard::now_ms;
using webots_cloud::guard::Program;
using webots_cloud::guard::Started;

constexpr long max_cleanup_ms = 60'000; // then the command is killed
constexpr long copy_removal_ms =
    5'000; // beyond the grace, for a guard elsewhere that removes what it has received
constexpr int descriptor_of_users = 3; // of a user namespace, with --subordinate

/// In the child. Where a file is not there, it is an empty one.
void open_files(Program const& program)
{
    for (int i = 0; i < program.opened_count; ++i) {
        int const wanted = std::atoi(program.opened[2 * i]);
        int file = open(program.opened[2 * i + 1], O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
        if (file < 0)
            file = open("/dev/null", O_RDONLY | O_CLOEXEC);
        if (file == wanted)
            fcntl(file, F_SETFD, 0);
        else
            dup2(file, wanted);
    }
}

[[noreturn]] void refuse_without_limits(Program const& program)
{
    std::printf("can't set the limits of %s: %s\n", program.argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

/// In the child, which is in its groups: executes the program.
[[noreturn]] void execute_in_groups(Program const& program)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL); // in case somebody kills the guard itself
    // A group of its own: what signals that group does not mean us.
    setpgid(0, 0);
    sigprocmask(SIG_SETMASK, &program.signals, nullptr);
    int const nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO);
    // Standard error of a job is for our own lines.
    if (program.is_job)
        dup2(STDOUT_FILENO, STDERR_FILENO);
    if (program.sent_count > 0 && !webots_cloud::guard::send_files(program.sent, program.sent_count)) {
        std::printf("webots-process-guard can't send\n");
        std::fflush(stdout);
        _exit(exec_failed);
    }
    if (!webots_cloud::guard::set_limits(program.limits))
        refuse_without_limits(program);
    open_files(program);
    execv(program.argv[0], program.argv);
    std::printf("can't run %s: %s\n", program.argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

/// In the child: executes the program.
[[noreturn]] void execute(Program const& program)
{
    if (!webots_cloud::guard::enter_groups(program.limits))
        refuse_without_limits(program);
    execute_in_groups(program);
}

/// The same, for programs that we do not trust.
[[noreturn]] void execute_confined(Program const& program)
{
    if (!webots_cloud::guard::enter_groups(program.limits)) // as long as this is the server's user
        refuse_without_limits(program);
    if (!program.set_user_id && !program.own_sandbox)
        webots_cloud::guard::drop_capabilities();
    if (program.user.is_other && !webots_cloud::guard::become(program.user)) {
        std::printf("can't run %s as user %u: %s\n", program.argv[0], program.user.user,
                    std::strerror(errno));
        std::fflush(stdout);
        _exit(exec_failed);
    }
    if (program.user.is_other && !program.set_user_id)
        prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    execute_in_groups(program);
}

/// The same where there is no PID namespace.
[[noreturn]] void execute_confined_without_namespace(Program const& program)
{
    if (!program.set_user_id)
        webots_cloud::guard::confine_signals();
    execute_confined(program);
}

/// For a probe: executes nothing.
[[noreturn]] void exit_at_once(Program const&)
{
    _exit(0);
}

/// Sends SIGKILL to every child. As they die, their children become ours, and get it in the next round.
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

/// Waits for everything that can happen to a program and its tree, and ends them in time. One thread and one
/// `poll`: nothing here may wait for anything else.
class Guard
{
public:
    /// `owner`: a pidfd of the server, or -1.
    Guard(Started started, long grace_ms, int owner)
        : program_(started.process), report_(started.report), listening_(started.listening),
          grace_ms_(grace_ms), owner_(owner)
    {}

    /// For a program without a control socket, which is killed after `time_ms`.
    static Guard with_time_limit(pid_t program, long time_ms)
    {
        Started started;
        started.process = program;
        Guard guard(started, 0, -1);
        guard.kill_at_ = now_ms() + time_ms;
        guard.control_open_ = false;
        return guard;
    }

    /// Returns the status of the program when no process is left.
    int watch(int signals);

    /// In place of SIGTERM, which the first process of a namespace translates.
    void end_by(int signal) { end_signal_ = report_ >= 0 ? SIGTERM : signal; }

    /// There is no control socket; what is new of the program is to be told.
    void watch_job(webots_cloud::guard::Job& job, bool has_own_network)
    {
        job_ = &job;
        has_own_network_ = has_own_network;
        control_open_ = false;
    }

    /// Whether the server has died, or wants to know nothing more of this program.
    bool is_abandoned() const { return !control_open_ || owner_gone_; }

    /// Whether it was asked to end the program.
    bool is_asked_to_end() const { return kill_at_ >= 0 || owner_gone_; }

private:
    void read_control();
    void pass_report_on();
    void reap();
    void terminate();
    int wait_time();

    pid_t program_;
    int report_;
    int listening_; ///< -1: nothing is to be heard of the program's port any more.
    long grace_ms_;
    int owner_;         ///< -1: it is not watched, or has died.
    long kill_at_ = -1; ///< When the grace period ends; -1: nobody has asked the program to end.
    int end_signal_ = SIGTERM;
    int status_ = 0;
    bool killing_ = false;
    bool control_open_ = true;
    bool owner_gone_ = false;
    bool tree_is_gone_ = false;
    webots_cloud::guard::Job* job_ = nullptr; ///< Null: we run where the server does.
    bool has_own_network_ = false;
};

void Guard::terminate()
{
    if (kill_at_ >= 0)
        return;
    kill_at_ = now_ms() + grace_ms_;
    if (program_ > 0)
        kill(program_, end_signal_);
}

void Guard::read_control()
{
    char bytes[16];
    ssize_t const size = read(STDIN_FILENO, bytes, sizeof bytes);
    if (size > 0)
        terminate();
    else if (size == 0 || (errno != EINTR && errno != EAGAIN)) {
        control_open_ = false;
        killing_ = true;
    }
}

/// Tells the server that the program's port can be reached. On a node of a cluster our next look finds that.
void Guard::pass_report_on()
{
    char byte = 0;
    ssize_t const size = read(listening_, &byte, 1);
    if (size < 0 && errno == EINTR)
        return;
    if (size == 1 && control_open_)
        send(STDIN_FILENO, "L", 1, MSG_NOSIGNAL | MSG_DONTWAIT);
    close(listening_); // also at its end: the relay is gone, and the program with it
    listening_ = -1;
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
        killing_ = true; // the rest of the tree is of no use without the program
    }
    tree_is_gone_ = ended < 0 && errno == ECHILD;
}

int Guard::wait_time()
{
    if (killing_)
        return 10; // children of killed processes become ours one by one
    if (kill_at_ < 0)
        return job_ ? webots_cloud::guard::tell_news(*job_, program_, has_own_network_) : -1;
    long const left = kill_at_ - now_ms();
    return left > 0 ? static_cast<int>(left) : 0;
}

int Guard::watch(int signals)
{
    for (;;) {
        // Whatever has woken us: several children may have ended for one SIGCHLD.
        reap();
        if (tree_is_gone_)
            return status_;
        if (kill_at_ >= 0 && now_ms() >= kill_at_)
            killing_ = true;
        if (killing_)
            kill_children();
        pollfd watched[] = {{signals, POLLIN, 0},
                            {control_open_ ? STDIN_FILENO : -1, POLLIN, 0},
                            {owner_, POLLIN, 0},
                            {listening_, POLLIN, 0}};
        if (poll(watched, 4, wait_time()) <= 0)
            continue;
        if (watched[3].revents != 0)
            pass_report_on();
        if (watched[1].revents != 0)
            read_control();
        if (watched[2].revents != 0) {
            // A process that has ended stays readable: without this, `poll` would not wait any more.
            owner_ = -1;
            owner_gone_ = true;
            killing_ = true;
        }
        signalfd_siginfo info{};
        if ((watched[0].revents & POLLIN) != 0 &&
            read(signals, &info, sizeof info) == static_cast<ssize_t>(sizeof info) &&
            info.ssi_signo != SIGCHLD)
            terminate();
    }
}

/// Exits with the wait status of the program, so that our parent sees what it would have seen without us.
[[noreturn]] void exit_with(int status)
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

/// Removes what the tree has left behind. The output is discarded: its reader, the server, may be dead, and
/// writing to a closed pipe would end the command.
void run_cleanup_command(char** argv, sigset_t const& original, int signals)
{
    Program command;
    command.argv = argv;
    command.signals = original;
    pid_t const program = fork();
    if (program == 0) {
        int const sink = open("/dev/null", O_WRONLY);
        dup2(sink, STDOUT_FILENO);
        dup2(sink, STDERR_FILENO);
        execute(command);
    }
    if (program > 0)
        Guard::with_time_limit(program, max_cleanup_ms).watch(signals);
}

/// Takes `--cleanup` and its command line out of ours, so that `argv` begins with the next argument. Null:
/// there is none.
char** take_cleanup_command(int& argc, char**& argv)
{
    --argc;
    ++argv;
    if (argc < 2 || std::strcmp(argv[0], "--cleanup") != 0)
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

/// Takes an option out of our command line.   Returns: whether it was there.
bool take_option(int& argc, char**& argv, char const* option)
{
    bool const given = argc > 0 && std::strcmp(argv[0], option) == 0;
    argc -= given ? 1 : 0;
    argv += given ? 1 : 0;
    return given;
}

/// Takes an option with one word out of our command line.   Returns: the word, or null.
char const* take_word(int& argc, char**& argv, char const* option)
{
    if (argc < 2 || !take_option(argc, argv, option))
        return nullptr;
    --argc;
    return *argv++;
}

/// Takes the options of the network out of our command line.   Returns: false when they are malformed.
bool take_network(int& argc, char**& argv, webots_cloud::guard::Network& network)
{
    using Reach = webots_cloud::guard::Network::Reach;
    if (!take_option(argc, argv, "--network"))
        return true;
    bool const none = take_option(argc, argv, "none");
    if (!none && !take_option(argc, argv, "internet"))
        return false;
    int const words = none ? 1 : 4;
    if (argc < words)
        return false;
    network.reach = none ? Reach::none : Reach::internet;
    network.port = std::atoi(argv[0]);
    if (!none) {
        network.slirp = argv[1];
        network.ip = argv[2];
        network.rules = argv[3];
    }
    argc -= words;
    argv += words;
    network.broker = take_word(argc, argv, "--broker");
    return true;
}

/// Takes the options of a container out of our command line.   Returns: false when they are malformed.
bool take_container(int& argc, char**& argv, webots_cloud::guard::Container& container)
{
    if (!take_option(argc, argv, "--container"))
        return true;
    if (argc < 2)
        return false;
    container.docker = argv[0];
    container.label = argv[1];
    argc -= 2;
    argv += 2;
    return true;
}

/// Takes the folders that must not be changed out of our command line.   Returns: their number; they lie
/// where the first `--read-only` was.
int take_read_only(int& argc, char**& argv)
{
    char** const folders = argv;
    int count = 0;
    while (argc > 1 && take_option(argc, argv, "--read-only")) {
        folders[count++] = argv[0];
        --argc;
        ++argv;
    }
    return count;
}

/// The same for the files that the program gets open.   Returns: the number of pairs.
int take_opened(int& argc, char**& argv)
{
    char** const pairs = argv;
    int count = 0;
    while (argc > 2 && take_option(argc, argv, "--open")) {
        pairs[2 * count] = argv[0];
        pairs[2 * count + 1] = argv[1];
        ++count;
        argc -= 2;
        argv += 2;
    }
    return count;
}

/// A pidfd of the process that has started us, which becomes readable when that ends.
int watch_owner()
{
    auto const owner = getppid(); // 0: in another PID namespace
    return owner > 0 ? static_cast<int>(syscall(SYS_pidfd_open, owner, 0)) : -1;
}

/// The usage text.
void explain(std::FILE* file)
{
    char const* before = "Usage:";
    for (char const* const form : webots_cloud::guard::forms) {
        std::fprintf(file, "%-6s %s %s\n", before, program_invocation_short_name, form);
        before = "";
    }
    std::fprintf(file, "\nwebots-simulation-server starts it for each simulation: it runs one program, and\n"
                       "ends all that this has started. People need --probe alone.\n\nOptions:\n");
    for (auto const& option : webots_cloud::guard::options)
        std::fprintf(file, "  --%s%s%s\n        %s\n", option.name, *option.value ? " " : "", option.value,
                     option.summary);
    std::fprintf(file, "\nSIGTERM, SIGINT and SIGHUP ask the program to end, as a byte on standard input\n"
                       "does; its end kills the whole tree. The exit status is that of the program;\n"
                       "127: it could not be started.\n");
}

int refuse_arguments()
{
    std::fprintf(stderr,
                 "%s: these arguments are not understood. webots-simulation-server starts this program; "
                 "--help says how.\n",
                 program_invocation_short_name);
    return 2;
}

/// A folder that is a subordinate user's until this is destroyed, if it is one.
class LentFolder
{
public:
    explicit LentFolder(webots_cloud::guard::User const& user) : user_(user) {}
    LentFolder(LentFolder const&) = delete;
    ~LentFolder() { take_back(); }

    /// When no process of the user is left.
    void take_back()
    {
        if (user_.is_subordinate && *user_.folder != '\0' && !is_back_)
            webots_cloud::guard::take_back(user_.folder); // else the server tries
        is_back_ = true;
    }

private:
    webots_cloud::guard::User const& user_;
    bool is_back_ = false;
};

/// Enters the user namespace that we were given.   False: it can't be entered, and a line says why.
bool enter_users()
{
    if (webots_cloud::guard::enter_user_namespace(descriptor_of_users)) {
        webots_cloud::guard::forbid_tracing(); // entering it has changed that
        return true;
    }
    std::printf("can't enter the user namespace of simulations: %s\n", std::strerror(errno));
    return false;
}

/// Does the one thing in a folder that our command line asks for.   Returns: the exit status; -1: it asks for
/// something else.
int work_in_folder(int argc, char** argv)
{
    if (argc == 2 && std::strcmp(argv[0], "--take-back") == 0) {
        if (webots_cloud::guard::take_back(argv[1]))
            return 0;
        std::printf("%s\n", std::strerror(errno));
        return 1;
    }
    if (argc == 3 && std::strcmp(argv[0], "--measure") == 0)
        return webots_cloud::guard::measure(argv[1], argv[2]);
    if (argc == 4 && std::strcmp(argv[0], "--put") == 0)
        return webots_cloud::guard::put(argv[1], argv[2], argv[3]);
    return -1;
}

/// Has the project of a job copied to this node.   Returns: whether it is here, and nobody wants us to end.
bool receive_project(webots_cloud::guard::Job& job, webots_cloud::guard::JobFolder& folder,
                     Program const& program, int signals, int owner)
{
    job.receives = true;
    webots_cloud::guard::tell(job, "receives 0");
    if (!folder.make(job.folder)) {
        std::fprintf(stderr, "tar: can't make the folder (%s)\n", std::strerror(errno));
        webots_cloud::guard::tell(job, "can't receive");
        return false;
    }
    Started receiver;
    receiver.process = fork();
    if (receiver.process == 0) {
        sigprocmask(SIG_SETMASK, &program.signals, nullptr);
        webots_cloud::guard::receive_files(job.folder);
    }
    // No grace, and no control socket: whoever wants the job to end ends this, too.
    Guard guard(receiver, 0, owner);
    guard.watch_job(job, false);
    int const status = guard.watch(signals);
    if (guard.is_asked_to_end())
        return false;
    if (receiver.process < 0 || status != 0 || chdir(job.directory) != 0) {
        webots_cloud::guard::tell(job, "can't receive");
        return false;
    }
    job.receives = false;
    webots_cloud::guard::tell(job, "has received");
    return true;
}

/// Prints what works here.
int probe(Program const& program)
{
    auto const started = webots_cloud::guard::start_in_namespace(program, exit_at_once);
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

/// Of the options with which the guard does one thing only, and not yet those for folders of users.
/// Returns: the exit status; -1: there is none of them.
int do_one_thing(int argc, char** argv)
{
    using namespace webots_cloud::guard;
    if (argc == 2 && std::strcmp(argv[1], "--help") == 0) {
        explain(stdout);
        return 0;
    }
    if (argc == 5 && std::strcmp(argv[1], "--try") == 0)
        return try_forbidden_things(argv[2], std::atoi(argv[3]), std::atoi(argv[4]));
    if (argc >= 4 && std::strcmp(argv[1], "--display") == 0)
        execute_on_display(argv[2], std::atoi(argv[3]), argv + 4);
    if (argc >= 3 && std::strcmp(argv[1], "--filter") == 0)
        execute_filtered(argv + 2);
    if (argc == 7 && std::strcmp(argv[1], "--make-users") == 0)
        return make_user_namespace(argv + 2);
    if (argc == 3 && std::strcmp(argv[1], "--pin-users") == 0)
        return pin_user_namespace(argv[2]);
    if (argc == 3 && std::strcmp(argv[1], "--unpin-users") == 0)
        return unpin_user_namespace(argv[2]);
    return -1;
}

/// What is said of the program, in the order of the usage. `argv` begins with GRACE_MS afterwards.
bool take_program(int& argc, char**& argv, Program& program)
{
    program.sent = argv;
    program.sent_count = webots_cloud::guard::take_sent(argc, argv);
    // srun kills the job at SIGTERM, guard and all; this one it passes on.
    program.end_signal = program.sent_count > 0 ? SIGUSR1 : SIGTERM;
    program.set_user_id = take_option(argc, argv, "--set-user-id");
    bool const understood = take_network(argc, argv, program.network) &&
                            webots_cloud::guard::take_limits(argc, argv, program.limits);
    bool const has_container = take_container(argc, argv, program.container);
    program.own_sandbox = take_word(argc, argv, "--own-sandbox");
    program.own_displays = take_option(argc, argv, "--own-displays");
    program.opened = argv;
    program.opened_count = take_opened(argc, argv);
    bool const user_understood = webots_cloud::guard::take_user(argc, argv, program.user);
    program.read_only = argv;
    program.read_only_count = take_read_only(argc, argv);
    program.argv = argv + 1;
    bool const is_of_somebody = program.user.is_other || !program.user.is_subordinate;
    return program.sent_count >= 0 && understood && has_container && user_understood && is_of_somebody;
}

/// Starts it as it is asked for, and where that was no more than a wish, without namespaces. What fails is
/// printed; then there is no process.
Started start_tree(Program const& program)
{
    Started started;
    if (program.container.docker) {
        started.process = fork();
        if (started.process == 0)
            webots_cloud::guard::run_beside_container(program, execute);
    } else {
        started = webots_cloud::guard::start_in_namespace(program, execute_confined);
    }
    // A network, a sandbox and displays of its own are no mere wishes: without them the program must not run.
    // Without namespaces it may.
    if (started.process < 0 && (program.network.is_own() || program.own_sandbox)) {
        std::printf("can't start %s in %s of its own: %s\n", program.argv[0],
                    program.network.is_own() ? "a network" : "a mount namespace",
                    started.network_failure == NetworkFailure::nothing ? std::strerror(started.error)
                                                                       : describe(started.network_failure));
        return started;
    }
    if (started.process < 0 && program.own_displays) {
        std::printf("can't start %s with displays of its own: %s\n", program.argv[0],
                    std::strerror(started.error));
        return started;
    }
    if (started.process < 0)
        started.process = fork();
    if (started.process == 0)
        execute_confined_without_namespace(program);
    if (started.process < 0)
        std::printf("can't start %s: %s\n", program.argv[0], std::strerror(errno));
    return started;
}

} // namespace

int main(int argc, char** argv)
{
    if (int const status = do_one_thing(argc, argv); status >= 0)
        return status;
    webots_cloud::guard::forbid_tracing();
    char** const cleanup_command = take_cleanup_command(argc, argv);
    webots_cloud::guard::Job job;
    bool const job_understood = webots_cloud::guard::take_job(argc, argv, job);
    bool const is_probe = take_option(argc, argv, "--probe");
    Program program;
    program.user.is_subordinate = take_option(argc, argv, "--subordinate");
    if (program.user.is_subordinate && !enter_users()) // it changes what must not be set before
        return exec_failed;
    bool const works_in_folder =
        program.user.is_subordinate || (argc > 0 && std::strcmp(argv[0], "--put") == 0);
    if (int const status = works_in_folder ? work_in_folder(argc, argv) : -1; status >= 0)
        return status;
    program.is_job = job.last > 0;
    bool const understood = take_program(argc, argv, program);
    if (!job_understood || !understood || (argc < 2 && !(is_probe && argc == 0)))
        return refuse_arguments();
    setsid(); // Ctrl-C in the terminal is for the server, which then ends its simulations in order
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    prctl(PR_SET_PDEATHSIG, SIGCONT); // wakes us when the server dies while we are stopped
    int const owner = watch_owner();
    sigset_t handled;
    sigemptyset(&handled);
    for (int const number : {SIGCHLD, SIGTERM, SIGINT, SIGHUP})
        sigaddset(&handled, number);
    if (program.is_job)
        sigaddset(&handled, SIGUSR1);
    // Before there is any child: from here on signals wait until they are read.
    sigprocmask(SIG_BLOCK, &handled, &program.signals);
    if (is_probe)
        return probe(program);
    if (job.last > 0)
        webots_cloud::guard::tell_node(job);
    int const signals = signalfd(-1, &handled, SFD_CLOEXEC | SFD_NONBLOCK);
    webots_cloud::guard::JobFolder folder;
    if (job.folder && !receive_project(job, folder, program, signals, owner))
        return exec_failed;
    LentFolder lent(program.user);
    if (program.user.is_other && !webots_cloud::guard::hand_over(program.user)) {
        std::printf("can't give %s to user %u: %s\n", program.user.folder, program.user.user,
                    std::strerror(errno));
        return exec_failed;
    }
    // Opened here, as the process that enters them may not reach these files any more.
    if (!webots_cloud::guard::open_groups(program.limits)) {
        std::printf("can't start %s in its control group: %s\n", program.argv[0], std::strerror(errno));
        return exec_failed;
    }
    if (signals < 0) {
        std::printf("can't start %s: %s\n", program.argv[0], std::strerror(errno));
        return exec_failed;
    }
    auto const started = start_tree(program);
    if (started.process < 0)
        return exec_failed;
    Guard guard(started, std::strtol(argv[0], nullptr, 10) + (program.sent_count > 0 ? copy_removal_ms : 0),
                owner);
    guard.end_by(program.end_signal);
    if (job.last > 0)
        guard.watch_job(job, program.network.is_own());
    int const status = guard.watch(signals);
    // No process is left: now what was theirs can be taken back and removed.
    lent.take_back();
    folder.remove();
    if (program.network.broker)
        unlink(program.network.broker);
    // Else the server does that, which still reads what they have counted.
    if (guard.is_abandoned())
        webots_cloud::guard::remove_groups(program.limits);
    if (cleanup_command)
        run_cleanup_command(cleanup_command, program.signals, signals);
    exit_with(status);
}
