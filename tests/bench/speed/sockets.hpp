// What the load generators and floors share: sockets and epoll by plain system calls, so that nothing of a
// library is in a measurement. A call that fails ends the program: a benchmark that goes on after an error
// measures something else.
#pragma once

#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <netinet/tcp.h>
#include <string>
#include <string_view>
#include <sys/epoll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>
#include <vector>

namespace speed {

inline int checked(int result, char const* what)
{
    if (result < 0) {
        std::fprintf(stderr, "%s: %s\n", what, std::strerror(errno));
        std::exit(1);
    }
    return result;
}

inline std::int64_t nanoseconds(clockid_t clock = CLOCK_MONOTONIC)
{
    timespec now{};
    clock_gettime(clock, &now);
    return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

/// As many open files as the machine allows; a peer that goes away is an error of a write, no signal.
inline void prepare_process()
{
    rlimit limit{};
    getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    setrlimit(RLIMIT_NOFILE, &limit);
    std::signal(SIGPIPE, SIG_IGN);
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
}

inline sockaddr_in address_of(in_addr_t host, int port)
{
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(host);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    return address;
}

/// The address of the machine with this number, from 0: 127.1.0.1 and up. One process listens on all of them.
inline in_addr_t machine_address(int number)
{
    return (127U << 24 | 1U << 16) + static_cast<in_addr_t>(number) + 1;
}

inline int listen_on(int port)
{
    int const listener = checked(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0), "socket");
    int const on = 1;
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    auto const address = address_of(INADDR_ANY, port);
    checked(bind(listener, reinterpret_cast<sockaddr const*>(&address), sizeof address), "bind");
    checked(listen(listener, 4096), "listen");
    return listener;
}

/// Begins to connect; the socket is writable once it is done.
inline int connect_to(in_addr_t host, int port)
{
    int const connection = checked(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0), "socket");
    int const on = 1;
    setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    auto const address = address_of(host, port);
    if (connect(connection, reinterpret_cast<sockaddr const*>(&address), sizeof address) < 0 &&
        errno != EINPROGRESS)
        checked(-1, "connect");
    return connection;
}

/// The next connection that waits, or -1.
inline int accept_from(int listener)
{
    int const connection = accept4(listener, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (connection >= 0) {
        int const on = 1;
        setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    }
    return connection;
}

/// Sends all of a short text; the peer's window always has room for it.
inline void send_text(int connection, std::string_view text)
{
    if (send(connection, text.data(), text.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(text.size()) &&
        errno != EPIPE && errno != ECONNRESET)
        checked(-1, "send");
}

class Poller
{
public:
    Poller() : epoll_(checked(epoll_create1(EPOLL_CLOEXEC), "epoll_create1")), events_(512) {}
    Poller(Poller const&) = delete;
    Poller& operator=(Poller const&) = delete;
    ~Poller() { close(epoll_); }

    void watch(int descriptor, std::uint32_t what = EPOLLIN, int operation = EPOLL_CTL_ADD)
    {
        epoll_event event{};
        event.events = what;
        event.data.fd = descriptor;
        checked(epoll_ctl(epoll_, operation, descriptor, &event), "epoll_ctl");
    }

    /// The descriptors that are ready, after at most `milliseconds`; -1 waits for ever.
    [[nodiscard]] std::vector<int> const& wait(int milliseconds = -1)
    {
        return ready(epoll_wait(epoll_, events_.data(), static_cast<int>(events_.size()), milliseconds));
    }

    /// The same until that time of nanoseconds().
    [[nodiscard]] std::vector<int> const& wait_until(std::int64_t time)
    {
        auto const left = std::max<std::int64_t>(0, time - nanoseconds());
        timespec const timeout{left / 1'000'000'000, left % 1'000'000'000};
        return ready(
            epoll_pwait2(epoll_, events_.data(), static_cast<int>(events_.size()), &timeout, nullptr));
    }

private:
    std::vector<int> const& ready(int count)
    {
        ready_.clear();
        for (int i = 0; i < count; ++i)
            ready_.push_back(events_[static_cast<std::size_t>(i)].data.fd);
        return ready_;
    }

    int epoll_;
    std::vector<epoll_event> events_;
    std::vector<int> ready_;
};

} // namespace speed
