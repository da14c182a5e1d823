// The program's port is in a network of its own; here connections from outside are passed into it, or sockets
// that are connected inside are handed out to the server. Runs as a process beside the program, with poll
// alone: it must stay small and must not fail.
#include "relay.hpp"

#include "clock.hpp"
#include "descriptor.hpp"
#include "listener.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

namespace webots_cloud::guard {
namespace {

// Webots serves a browser with a WebSocket, a stream of pictures and a few files at a time.
constexpr std::size_t max_connections = 128;
// Between two looks for the listener, in the kernel's tables, for which it walks all connections of the
// machine. Where it can be asked for listeners alone (listener.hpp), looks are closer.
constexpr int min_table_look_ms = 25;
constexpr int connect_limit_ms = 10'000; // of a program that accepts nothing
constexpr int pause_ms = 100;            // of descriptors, say, that are used up
constexpr int backlog = 64;
constexpr unsigned state_listen = 10; // TCP_LISTEN, as /proc/net/tcp has it

sockaddr_in address_of(std::uint32_t host, int port)
{
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(host);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
}

/// Whether a table of sockets (`/proc/net/tcp`, `tcp6`) has one that listens on the port.
bool has_listener(char const* table, unsigned port)
{
    std::FILE* const file = std::fopen(table, "re");
    if (!file)
        return false;
    bool found = false;
    char line[512];
    while (!found && std::fgets(line, sizeof line, file)) {
        unsigned local = 0;
        unsigned state = 0;
        found = std::sscanf(line, " %*d: %*[0-9A-F]:%x %*[0-9A-F]:%*x %x", &local, &state) == 2 &&
                local == port && state == state_listen;
    }
    std::fclose(file);
    return found;
}

/// Waits until somebody listens on the port.
void await_listener(int port)
{
    ListenerQuestion question(port);
    auto const begin = now_ms();
    for (;;) {
        auto const answer = question.ask();
        bool const is_known = answer != ListenerQuestion::Answer::unknown;
        if (is_known ? answer == ListenerQuestion::Answer::yes
                     : has_listener("/proc/self/net/tcp", static_cast<unsigned>(port)) ||
                           has_listener("/proc/self/net/tcp6", static_cast<unsigned>(port)))
            return;
        poll(nullptr, 0, std::max(pause_between_looks(now_ms() - begin), is_known ? 0 : min_table_look_ms));
    }
}

/// Bytes on their way from one socket to another.
class Flow
{
public:
    bool wants_input() const { return !ended_ && end_ < buffer_.size(); }
    bool wants_output() const { return begin_ < end_; }
    bool is_finished() const { return ended_ && begin_ == end_; }

    /// False: the connection is broken.
    bool read_from(int socket)
    {
        auto const size = read(socket, buffer_.data() + end_, buffer_.size() - end_);
        if (size < 0)
            return errno == EAGAIN || errno == EINTR;
        ended_ = size == 0;
        end_ += static_cast<std::size_t>(size);
        return true;
    }

    bool write_to(int socket)
    {
        auto const size = send(socket, buffer_.data() + begin_, end_ - begin_, MSG_NOSIGNAL);
        if (size < 0)
            return errno == EAGAIN || errno == EINTR;
        begin_ += static_cast<std::size_t>(size);
        if (begin_ == end_)
            begin_ = end_ = 0;
        return true;
    }

    /// Tells the receiver that nothing follows, once everything is written.
    void pass_end_on(int socket)
    {
        if (is_finished() && !told_) {
            shutdown(socket, SHUT_WR);
            told_ = true;
        }
    }

private:
    std::array<char, 32 * 1024> buffer_;
    std::size_t begin_ = 0;
    std::size_t end_ = 0;
    bool ended_ = false;
    bool told_ = false;
};

/// A connection from outside and the one to the program that belongs to it, with what is on its way in both
/// directions.
class Connection
{
public:
    Connection(int outside, int inside) : outside_(outside), inside_(inside) {}
    Connection(Connection&&) = delete;
    ~Connection()
    {
        close(outside_);
        close(inside_);
    }

    std::array<pollfd, 2> interests() const
    {
        auto const events = [](Flow const& from, Flow const& to) {
            return static_cast<short>((from.wants_input() ? POLLIN : 0) | (to.wants_output() ? POLLOUT : 0));
        };
        return {pollfd{outside_, events(inwards_, outwards_), 0},
                pollfd{inside_, events(outwards_, inwards_), 0}};
    }

    /// False: it is over.
    bool serve(short outside, short inside)
    {
        constexpr short broken = POLLERR | POLLNVAL;
        if (((outside | inside) & broken) != 0)
            return false;
        if (!pass_on(inwards_, outside_, outside, inside_, inside) ||
            !pass_on(outwards_, inside_, inside, outside_, outside))
            return false;
        return !inwards_.is_finished() || !outwards_.is_finished();
    }

private:
    static bool pass_on(Flow& flow, int from, short readable, int to, short writable)
    {
        if (flow.wants_input() && (readable & (POLLIN | POLLHUP)) != 0 && !flow.read_from(from))
            return false;
        if (flow.wants_output() && (writable & POLLOUT) != 0 && !flow.write_to(to))
            return false;
        flow.pass_end_on(to);
        return true;
    }

    int outside_;
    int inside_;
    Flow inwards_;
    Flow outwards_;
};

/// Starts to connect to the program; -1: that is not possible.
int connect_inside(int port)
{
    int const made = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    auto const address = address_of(INADDR_LOOPBACK, port);
    if (made >= 0 && connect(made, reinterpret_cast<sockaddr const*>(&address), sizeof address) != 0 &&
        errno != EINPROGRESS) {
        close(made);
        return -1;
    }
    return made;
}

void accept_one(int acceptor, int port, std::vector<std::unique_ptr<Connection>>& connections)
{
    int const outside = accept4(acceptor, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (outside < 0)
        return;
    int const inside = connect_inside(port);
    if (inside < 0)
        close(outside);
    else
        connections.push_back(std::make_unique<Connection>(outside, inside));
}

/// A socket that is connected to the program; -1: it does not answer.
int connected_inside(int port)
{
    int const made = connect_inside(port);
    pollfd watched{made, POLLOUT, 0};
    int error = 0;
    socklen_t size = sizeof error;
    if (made >= 0 && poll(&watched, 1, connect_limit_ms) == 1 &&
        getsockopt(made, SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error == 0)
        return made;
    close(made);
    return -1;
}

/// Of both ways to serve. Nobody may trace us, and we end with our namespace. Returns once the program
/// listens, and so do we, which `report` is told.
void begin_to_serve(int acceptor, int port, int report)
{
    prctl(PR_SET_DUMPABLE, 0);
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    std::signal(SIGTERM, SIG_IGN);
    await_listener(port);
    if (!start_listening(acceptor))
        _exit(1);
    if (report >= 0 && write(report, "l", 1) != 1)
        _exit(1); // the guard has ended
    close(report);
}

/// A socket that has the address to itself, and does not listen yet. Of IPv6 and IPv4, if it is `::`.
int bind_address(sockaddr const& address, socklen_t size)
{
    int const made = socket(address.sa_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (made < 0)
        return -1;
    int const on = 1;
    int const off = 0;
    setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on); // else ports in TIME_WAIT are taken
    if (address.sa_family == AF_INET6)
        setsockopt(made, IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
    // Of two sockets with reusable addresses either may take the port until one listens. So this one listens
    // for a moment, and keeps the port as one whose address is not reusable.
    if (bind(made, &address, size) == 0 && listen(made, 1) == 0 &&
        setsockopt(made, SOL_SOCKET, SO_REUSEADDR, &off, sizeof off) == 0 && shutdown(made, SHUT_RD) == 0)
        return made;
    int const error = errno;
    close(made);
    errno = error;
    return -1;
}

} // namespace

int bind_port(int port)
{
    sockaddr_in6 everywhere{};
    everywhere.sin6_family = AF_INET6;
    everywhere.sin6_port = htons(static_cast<std::uint16_t>(port));
    int const made = bind_address(reinterpret_cast<sockaddr const&>(everywhere), sizeof everywhere);
    if (made >= 0 || (errno != EAFNOSUPPORT && errno != EADDRNOTAVAIL)) // a machine without IPv6
        return made;
    auto const address = address_of(INADDR_ANY, port);
    return bind_address(reinterpret_cast<sockaddr const&>(address), sizeof address);
}

int bind_broker(char const* path)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (std::strlen(path) >= sizeof address.sun_path) {
        errno = ENAMETOOLONG;
        return -1;
    }
    std::strcpy(address.sun_path, path);
    unlink(path); // of a guard that was killed
    int const made = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (made >= 0 && bind(made, reinterpret_cast<sockaddr const*>(&address), sizeof address) == 0)
        return made;
    int const error = errno;
    close(made);
    errno = error;
    return -1;
}

bool start_listening(int acceptor)
{
    int const on = 1;
    setsockopt(acceptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on); // as in bind_port
    return listen(acceptor, backlog) == 0;
}

void relay(int acceptor, int port, int report)
{
    begin_to_serve(acceptor, port, report);
    std::vector<std::unique_ptr<Connection>> connections;
    std::vector<pollfd> watched;
    for (;;) {
        watched.clear();
        for (auto const& connection : connections)
            for (auto const& each : connection->interests())
                watched.push_back(each);
        // Without room for one more, it waits in the queue of the kernel.
        watched.push_back({connections.size() < max_connections ? acceptor : -1, POLLIN, 0});
        if (poll(watched.data(), watched.size(), -1) < 0)
            continue;
        for (std::size_t i = 0; i < connections.size(); ++i)
            if (!connections[i]->serve(watched[2 * i].revents, watched[2 * i + 1].revents))
                connections[i].reset();
        // Only now: `watched` was in the same order.
        connections.erase(std::remove(connections.begin(), connections.end(), nullptr), connections.end());
        if ((watched.back().revents & POLLIN) != 0)
            accept_one(acceptor, port, connections);
    }
}

void hand_out(int acceptor, int port, int report)
{
    begin_to_serve(acceptor, port, report);
    for (;;) {
        int const asker = accept4(acceptor, nullptr, nullptr, SOCK_CLOEXEC);
        if (asker < 0) {
            poll(nullptr, 0, pause_ms);
            continue;
        }
        int const inside = connected_inside(port);
        if (inside >= 0)
            send_descriptor(asker, inside, MSG_DONTWAIT);
        close(inside);
        close(asker);
    }
}

} // namespace webots_cloud::guard
