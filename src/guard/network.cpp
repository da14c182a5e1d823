// Inside its namespace the program gets a loopback and, where it may, slirp4netns; the rules are in force
// before it reaches anything. Half of the work is done inside and half outside, hence the two processes that
// wait for each other.
#include "network.hpp"

#include "descriptor.hpp"
#include "exit_status.hpp"
#include "privileges.hpp"
#include "relay.hpp"

#include <fcntl.h>
#include <linux/capability.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <utility>

namespace webots_cloud::guard {
namespace {

constexpr int slirp_limit_ms = 10'000; // for slirp4netns to get ready

bool bring_loopback_up()
{
    int const any = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    ifreq request{};
    std::strcpy(request.ifr_name, "lo");
    request.ifr_flags = IFF_UP | IFF_RUNNING;
    bool const up = any >= 0 && ioctl(any, SIOCSIFFLAGS, &request) == 0;
    close(any);
    return up;
}

/// Gives up the control socket and the output of the guard.
void let_go_of_input_and_output()
{
    int const nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
    for (int const each : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        dup2(nothing, each);
}

/// Executes a helper program in silence.
[[noreturn]] void execute_quietly(char const* const* argv)
{
    let_go_of_input_and_output();
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    execv(argv[0], const_cast<char* const*>(argv));
    _exit(exec_failed);
}

/// The next program may configure networks of our user namespace although it is not root there: capabilities
/// are lost with `exec` unless they are ambient.
void keep_network_capability()
{
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct sets[2] = {};
    if (syscall(SYS_capget, &header, sets) != 0)
        return;
    sets[0].inheritable |= 1U << CAP_NET_ADMIN;
    if (syscall(SYS_capset, &header, sets) == 0)
        prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_RAISE, CAP_NET_ADMIN, 0, 0);
}

[[noreturn]] void pass_on(int acceptor, Network const& network, int report)
{
    if (network.broker)
        hand_out(acceptor, network.port, report);
    relay(acceptor, network.port, report);
}

bool say_ready(int socket)
{
    return send(socket, "r", 1, MSG_NOSIGNAL) == 1;
}

bool await_ready(int socket)
{
    char byte = 0;
    ssize_t size = -1;
    while ((size = recv(socket, &byte, 1, 0)) < 0 && errno == EINTR)
        continue;
    return size == 1;
}

void let_go(int& descriptor)
{
    if (descriptor >= 0)
        close(descriptor);
    descriptor = -1;
}

} // namespace

char const* describe(NetworkFailure failure)
{
    switch (failure) {
    case NetworkFailure::nothing:
        break;
    case NetworkFailure::loopback:
        return "its loopback can't be brought up";
    case NetworkFailure::slirp:
        return "slirp4netns does not work (may this user open /dev/net/tun?)";
    case NetworkFailure::rules:
        return "ip can't set its routes";
    case NetworkFailure::addresses:
        return "the addresses of this machine can't be kept out of it";
    case NetworkFailure::relay:
        return "there are too many processes";
    }
    return "";
}

bool ends_well(pid_t child)
{
    int status = 0;
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
        continue;
    return child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

bool apply_rules(char const* ip, char const* rules)
{
    pid_t const child = fork();
    if (child == 0) {
        keep_network_capability();
        char const* const argv[] = {ip, "-batch", rules, nullptr};
        execute_quietly(argv);
    }
    return ends_well(child);
}

bool attach_slirp(Network const& network, pid_t inside)
{
    int ready[2];
    if (pipe2(ready, O_CLOEXEC) != 0)
        return false;
    pid_t const child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        fcntl(ready[1], F_SETFD, 0);
        char ready_fd[32];
        char number[32];
        std::snprintf(ready_fd, sizeof ready_fd, "--ready-fd=%d", ready[1]);
        std::snprintf(number, sizeof number, "%d", inside);
        // Its own sandbox mounts a file system over /tmp, which everybody would see where mounts are shared.
        if (geteuid() == 0 &&
            (unshare(CLONE_NEWNS) != 0 || mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0))
            _exit(exec_failed);
        // Its own sandbox works for root only: it wants user 0 in our user namespace, where there is none.
        char const* const confined = geteuid() == 0 ? "--enable-sandbox" : "--enable-seccomp";
        char const* const argv[] = {network.slirp,
                                    "--configure",
                                    "--mtu=65520",
                                    "--disable-host-loopback",
                                    "--enable-seccomp",
                                    confined,
                                    ready_fd,
                                    number,
                                    "tap0",
                                    nullptr};
        execute_quietly(argv);
    }
    close(ready[1]);
    pollfd watched{ready[0], POLLIN, 0};
    char byte = 0;
    bool const attached =
        child > 0 && poll(&watched, 1, slirp_limit_ms) == 1 && read(ready[0], &byte, 1) == 1;
    close(ready[0]);
    if (!attached && child > 0)
        kill(child, SIGKILL); // reaped with all others
    return attached;
}

int bind_for(Network const& network)
{
    return network.broker ? bind_broker(network.broker) : bind_port(network.port);
}

void serve(int acceptor, Network const& network, OwnAddresses& own, int report)
{
    if (network.reach != Network::Reach::internet)
        pass_on(acceptor, network, report);
    forbid_tracing(); // who had our sockets would have a say over the routes
    std::signal(SIGTERM, SIG_IGN);
    pid_t const us = getpid();
    pid_t const server = acceptor >= 0 ? fork() : -1;
    if (server == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        // It may have ended before the call above.
        if (getppid() == us)
            pass_on(acceptor, network, report);
        _exit(1);
    }
    close(acceptor);
    close(report);
    if (acceptor < 0 || server > 0)
        own.follow(server);
    _exit(1); // whoever started us ends the program then
}

NetworkSetup::~NetworkSetup()
{
    for (int* const descriptor : {&acceptor_, &ends_[0], &ends_[1], &report_[0], &report_[1]})
        let_go(*descriptor);
}

bool NetworkSetup::prepare()
{
    if (!network_.is_own())
        return true;
    if (network_.reach == Network::Reach::internet && !own_.listen())
        return false;
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends_) != 0)
        return false;
    if (network_.port == 0)
        return true;
    acceptor_ = bind_for(network_);
    return acceptor_ >= 0 && pipe2(report_, O_CLOEXEC) == 0;
}

NetworkFailure NetworkSetup::complete_inside()
{
    if (!network_.is_own())
        return NetworkFailure::nothing;
    let_go(ends_[0]);
    let_go(report_[0]);
    if (!bring_loopback_up())
        return NetworkFailure::loopback;
    int const dumpable = prctl(PR_GET_DUMPABLE);
    prctl(PR_SET_DUMPABLE, 1); // slirp4netns, started by the same user, enters our namespaces through /proc
    bool const attached = say_ready(ends_[1]) && await_ready(ends_[1]);
    prctl(PR_SET_DUMPABLE, dumpable);
    let_go(ends_[1]);
    if (!attached)
        return NetworkFailure::slirp;
    // In force before the program starts, and so before anything uses the way that slirp4netns has opened.
    if (network_.reach == Network::Reach::internet && !apply_rules(network_.ip, network_.rules))
        return NetworkFailure::rules;
    if (network_.reach == Network::Reach::internet && !own_.forbid_all())
        return NetworkFailure::addresses;
    if (acceptor_ < 0 && network_.reach != Network::Reach::internet)
        return NetworkFailure::nothing;
    relay_ = fork();
    if (relay_ == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL); // without a PID namespace nothing else ends it with the tree
        let_go_of_input_and_output();
        serve(acceptor_, network_, own_, report_[1]);
    }
    let_go(acceptor_);
    let_go(report_[1]);
    return relay_ > 0 ? NetworkFailure::nothing : NetworkFailure::relay;
}

void NetworkSetup::complete_outside(pid_t inside)
{
    if (!network_.is_own())
        return;
    // These are for the other side. As long as we had them, too, we would not hear of its end.
    let_go(ends_[1]);
    let_go(acceptor_);
    let_go(report_[1]);
    await_word_of(inside, ends_[0]);
    if (await_ready(ends_[0]) &&
        (network_.reach != Network::Reach::internet || attach_slirp(network_, inside)))
        say_ready(ends_[0]);
    let_go(ends_[0]);
}

} // namespace webots_cloud::guard
