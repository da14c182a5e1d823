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

#include "arguments.hpp"
#include "attempts.hpp"
#include "container_network.hpp"
#include "display.hpp"
#include "execution.hpp"
#include "exit_status.hpp"
#include "folders.hpp"
#include "job.hpp"
#include "job_folder.hpp"
#include "pid_namespace.hpp"
#include "privileges.hpp"
#include "subordinate.hpp"
#include "system_calls.hpp"
#include "tree_watch.hpp"

#include <fcntl.h>
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
#include <initializer_list>

using namespace webots_cloud::guard;

namespace {

constexpr long max_cleanup_ms = 60'000; // then the command is killed
constexpr long copy_removal_ms =
    5'000; // beyond the grace, for a guard elsewhere that removes what it has received
constexpr int descriptor_of_users = 3; // of a user namespace, with --subordinate

/// For a probe: executes nothing.
[[noreturn]] void exit_at_once(Program const&)
{
    _exit(0);
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
        TreeWatch::with_time_limit(program, max_cleanup_ms).watch(signals);
}

/// A pidfd of the process that has started us, which becomes readable when that ends.
int watch_owner()
{
    auto const owner = getppid(); // 0: in another PID namespace
    return owner > 0 ? static_cast<int>(syscall(SYS_pidfd_open, owner, 0)) : -1;
}

/// A folder that is a subordinate user's until this is destroyed, if it is one.
class LentFolder
{
public:
    explicit LentFolder(User const& user) : user_(user) {}
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
    User const& user_;
    bool is_back_ = false;
};

/// Enters the user namespace that we were given.   False: it can't be entered, and a line says why.
bool enter_users()
{
    if (enter_user_namespace(descriptor_of_users)) {
        forbid_tracing(); // entering it has changed that
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
        if (take_back(argv[1]))
            return 0;
        std::printf("%s\n", std::strerror(errno));
        return 1;
    }
    if (argc == 3 && std::strcmp(argv[0], "--measure") == 0)
        return measure(argv[1], argv[2]);
    if (argc == 4 && std::strcmp(argv[0], "--put") == 0)
        return put(argv[1], argv[2], argv[3]);
    return -1;
}

/// Has the project of a job copied to this node.   Returns: whether it is here, and nobody wants us to end.
bool receive_project(Job& job, JobFolder& folder, Program const& program, int signals, int owner)
{
    job.receives = true;
    tell(job, "receives 0");
    if (!folder.make(job.folder)) {
        std::fprintf(stderr, "tar: can't make the folder (%s)\n", std::strerror(errno));
        tell(job, "can't receive");
        return false;
    }
    Started receiver;
    receiver.process = fork();
    if (receiver.process == 0) {
        sigprocmask(SIG_SETMASK, &program.signals, nullptr);
        receive_files(job.folder);
    }
    // No grace, and no control socket: whoever wants the job to end ends this, too.
    TreeWatch tree(receiver, 0, owner);
    tree.watch_job(job, false);
    int const status = tree.watch(signals);
    if (tree.is_asked_to_end())
        return false;
    if (receiver.process < 0 || status != 0 || chdir(job.directory) != 0) {
        tell(job, "can't receive");
        return false;
    }
    job.receives = false;
    tell(job, "has received");
    return true;
}

/// Prints what works here.
int probe(Program const& program)
{
    auto const started = start_in_namespace(program, exit_at_once);
    if (started.process > 0) {
        waitpid(started.process, nullptr, 0);
        std::printf("namespace%s%s\n", started.own_proc ? " proc" : "",
                    started.read_only ? " read-only" : "");
    } else {
        std::printf("%s: %s\n", can_confine_signals() ? "signals" : "none", std::strerror(started.error));
    }
    return 0;
}

/// Of the options with which the guard does one thing only, and not yet those for folders of users.
/// Returns: the exit status; -1: there is none of them.
int do_one_thing(int argc, char** argv)
{
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

/// Starts it as it is asked for, and where that was no more than a wish, without namespaces. What fails is
/// printed; then there is no process.
Started start_tree(Program const& program)
{
    Started started;
    if (program.container.docker) {
        started.process = fork();
        if (started.process == 0)
            run_beside_container(program, execute);
    } else {
        started = start_in_namespace(program, execute_confined);
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
    forbid_tracing();
    char** const cleanup_command = take_cleanup_command(argc, argv);
    Job job;
    bool const job_understood = take_job(argc, argv, job);
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
        tell_node(job);
    int const signals = signalfd(-1, &handled, SFD_CLOEXEC | SFD_NONBLOCK);
    JobFolder folder;
    if (job.folder && !receive_project(job, folder, program, signals, owner))
        return exec_failed;
    LentFolder lent(program.user);
    if (program.user.is_other && !hand_over(program.user)) {
        std::printf("can't give %s to user %u: %s\n", program.user.folder, program.user.user,
                    std::strerror(errno));
        return exec_failed;
    }
    // Opened here, as the process that enters them may not reach these files any more.
    if (!open_groups(program.limits)) {
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
    TreeWatch tree(started,
                   std::strtol(argv[0], nullptr, 10) + (program.sent_count > 0 ? copy_removal_ms : 0), owner);
    tree.end_by(program.end_signal);
    if (job.last > 0)
        tree.watch_job(job, program.network.is_own());
    int const status = tree.watch(signals);
    // No process is left: now what was theirs can be taken back and removed.
    lent.take_back();
    folder.remove();
    if (program.network.broker)
        unlink(program.network.broker);
    // Else the server does that, which still reads what they have counted.
    if (tree.is_abandoned())
        remove_groups(program.limits);
    if (cleanup_command)
        run_cleanup_command(cleanup_command, program.signals, signals);
    exit_with(status);
}
