// Docker starts a container without a network, and this process, which follows docker events, puts one around
// it. Nothing of the machine's firewall is touched, so nothing has to be removed.
#include "container_network.hpp"

#include "exit_status.hpp"
#include "relay.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace webots_cloud::guard {
namespace {

/// A program whose output we read.
struct Child
{
    pid_t process = -1;
    int output = -1;
};

Child start(char const* const* argv)
{
    Child child;
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return child;
    child.process = fork();
    if (child.process == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        sigset_t none;
        sigemptyset(&none);
        sigprocmask(SIG_SETMASK, &none, nullptr);
        int const nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
        dup2(nothing, STDIN_FILENO);
        dup2(ends[1], STDOUT_FILENO);
        dup2(nothing, STDERR_FILENO);
        execv(argv[0], const_cast<char* const*>(argv));
        _exit(exec_failed);
    }
    close(ends[1]);
    child.output = ends[0];
    return child;
}

/// Prints the identifier of each of our containers that starts, a line each, from now on.
Child watch_starts(Container const& container)
{
    char since[32];
    char label[300];
    std::snprintf(since, sizeof since, "%lld", static_cast<long long>(std::time(nullptr)));
    std::snprintf(label, sizeof label, "label=%s", container.label);
    char const* const argv[] = {container.docker, "events", "--since",  since,     "--filter", "event=start",
                                "--filter",       label,    "--format", "{{.ID}}", nullptr};
    return start(argv);
}

/// The number of the first process of a container; 0: it has none.
pid_t process_of(char const* docker, char const* container)
{
    char const* const argv[] = {docker, "inspect", "--format", "{{.State.Pid}}", container, nullptr};
    auto const child = start(argv);
    char text[32] = "";
    std::size_t size = 0;
    for (ssize_t more = 1;
         child.output >= 0 && (more > 0 || (more < 0 && errno == EINTR)) && size < sizeof text - 1;) {
        more = read(child.output, text + size, sizeof text - 1 - size);
        size += more > 0 ? static_cast<std::size_t>(more) : 0;
    }
    close(child.output);
    while (child.process > 0 && waitpid(child.process, nullptr, 0) < 0 && errno == EINTR)
        continue;
    return static_cast<pid_t>(std::strtol(text, nullptr, 10));
}

/// The network namespace of a process, which must not be ours; -1: there is none.
int other_network(pid_t process)
{
    char path[64];
    std::snprintf(path, sizeof path, "/proc/%d/ns/net", process);
    int const found = process > 0 ? open(path, O_RDONLY | O_CLOEXEC) : -1;
    struct stat its
    {};
    struct stat ours
    {};
    if (found >= 0 && fstat(found, &its) == 0 && stat("/proc/self/ns/net", &ours) == 0 &&
        (its.st_ino != ours.st_ino || its.st_dev != ours.st_dev))
        return found;
    close(found);
    return -1;
}

bool apply_rules_in(int other, Network const& network)
{
    pid_t const child = fork();
    if (child == 0)
        _exit(setns(other, CLONE_NEWNET) == 0 && apply_rules(network.ip, network.rules) ? 0 : 1);
    return ends_well(child);
}

/// In a child: makes the network, and relays connections until it is killed.
[[noreturn]] void serve_network(Network const& network, Container const& container, char const* id,
                                int acceptor)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    OwnAddresses own;
    // Heard while we are still in the network of the machine: later only the container's could be seen.
    bool const reaches_internet = network.reach == Network::Reach::internet;
    bool const hears = !reaches_internet || own.listen();
    pid_t const process = process_of(container.docker, id);
    int const other = other_network(process);
    int const ours = open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
    // All that is forbidden comes before slirp4netns, which opens the way: the container is running already.
    char const* problem = nullptr;
    if (other < 0)
        problem = "it has none of its own";
    else if (!hears)
        problem = "the addresses of this machine can't be looked up";
    else if (reaches_internet && !apply_rules_in(other, network))
        problem = "its routes can't be set";
    // Back again: slirp4netns needs the network of the machine.
    else if (reaches_internet &&
             (setns(other, CLONE_NEWNET) != 0 || !own.forbid_all() || setns(ours, CLONE_NEWNET) != 0))
        problem = "the addresses of this machine can't be kept out of it";
    else if (reaches_internet && !attach_slirp(network, process))
        problem = "slirp4netns can't be attached";
    else if (setns(other, CLONE_NEWNET) != 0)
        problem = std::strerror(errno);
    constexpr int no_report = -1; // the server believes what the simulator prints
    if (!problem)
        serve(acceptor, network, own, no_report);
    std::printf("can't make the network of the container: %s\n", problem);
    std::fflush(stdout);
    _exit(1);
}

/// Takes the next line that has arrived whole. `id` has room for `max`.   False: there is none yet, or no
/// more.
bool next_line(int from, char* id, std::size_t max, std::size_t& size)
{
    char byte = 0;
    while (read(from, &byte, 1) == 1) {
        if (byte == '\n') {
            id[size] = '\0';
            size = 0;
            return true;
        }
        if (size < max - 1)
            id[size++] = byte;
    }
    return false;
}

[[noreturn]] void finish(int status)
{
    std::fflush(stdout);
    _exit(status); // the guard kills our children
}

} // namespace

void run_beside_container(Program const& program, Execute execute)
{
    auto const& container = program.container;
    // The server announces a simulator in a container by what it prints, which may come before its network is
    // complete: browsers wait meanwhile.
    int const acceptor = bind_for(program.network);
    if (acceptor < 0 || !start_listening(acceptor)) {
        std::printf("can't listen on port %d: %s\n", program.network.port, std::strerror(errno));
        finish(1);
    }
    sigset_t handled;
    sigemptyset(&handled);
    sigaddset(&handled, SIGCHLD);
    sigaddset(&handled, SIGTERM);
    sigprocmask(SIG_BLOCK, &handled, nullptr);
    int const signals = signalfd(-1, &handled, SFD_CLOEXEC | SFD_NONBLOCK);
    // Before compose starts: no start of a container is missed.
    auto const starts = watch_starts(container);
    fcntl(starts.output, F_SETFL, O_NONBLOCK);
    pid_t const main = fork();
    if (main == 0)
        execute(program);
    if (main < 0 || starts.process < 0 || signals < 0) {
        std::printf("can't start %s: %s\n", program.argv[0], std::strerror(errno));
        finish(1);
    }
    char id[128];
    std::size_t size = 0;
    pid_t network = -1;
    for (bool watching = true;;) {
        pollfd watched[] = {{signals, POLLIN, 0}, {watching ? starts.output : -1, POLLIN, 0}};
        if (poll(watched, 2, -1) < 0)
            continue;
        while (next_line(starts.output, id, sizeof id, size)) {
            if (network > 0)
                kill(network, SIGKILL); // that of a container that was started again
            std::fflush(stdout);
            network = fork();
            if (network == 0)
                serve_network(program.network, container, id, acceptor);
        }
        watching = (watched[1].revents & (POLLHUP | POLLERR)) == 0;
        signalfd_siginfo info{};
        while (read(signals, &info, sizeof info) == static_cast<ssize_t>(sizeof info))
            if (info.ssi_signo == SIGTERM)
                kill(main, SIGTERM);
        int status = 0;
        for (pid_t ended = 0; (ended = waitpid(-1, &status, WNOHANG)) > 0;) {
            if (ended == main)
                finish(WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status));
            if (ended == starts.process) {
                std::printf(
                    "error: Docker does not answer any more. The operator of this server has to start it "
                    "again.\n");
                std::fflush(stdout);
            }
            if (ended == network || ended == starts.process) {
                kill(main, SIGTERM); // the container has no network, or would get none
                network = ended == network ? -1 : network;
            }
        }
    }
}

} // namespace webots_cloud::guard
