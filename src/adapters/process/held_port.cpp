#include "held_port.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "core/text.hpp"

#include <netinet/in.h>
#include <sys/socket.h>

#include <cerrno>
#include <string>
#include <system_error>
#include <utility>

namespace webots_cloud::adapters {
namespace {

/// A bound port that refuses connections. Nobody waits for it, and so it takes no watch of the event loop's.
class BoundPort final : public PortHold
{
public:
    explicit BoundPort(FileDescriptor socket) : socket_(std::move(socket)) {}

private:
    FileDescriptor socket_;
};

/// A bound socket that refuses connections; without one: `errno` says why.
FileDescriptor hold_address(sockaddr const& address, socklen_t size)
{
    constexpr int on = 1;
    constexpr int off = 0;
    FileDescriptor socket(::socket(address.sa_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    int const number = socket.get();
    if (socket && address.sa_family == AF_INET6)
        ::setsockopt(number, IPPROTO_IPV6, IPV6_V6ONLY, &off, sizeof off);
    // With the address reusable, ports in TIME_WAIT count as free, as they are for the simulator. Other
    // sockets with SO_REUSEADDR, which all servers set, could still bind the port, unless this one listens or
    // has a port that is not reusable. So it listens until the option is off again; then it is shut down, so
    // that it accepts no connection that nobody would answer.
    if (!socket || ::setsockopt(number, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        ::bind(number, &address, size) != 0 || ::listen(number, 1) != 0 ||
        ::setsockopt(number, SOL_SOCKET, SO_REUSEADDR, &off, sizeof off) != 0 ||
        ::shutdown(number, SHUT_RD) != 0)
        return FileDescriptor();
    return socket;
}

} // namespace

result<std::unique_ptr<PortHold>> hold_port(std::uint16_t port)
{
    sockaddr_in6 everywhere{};
    everywhere.sin6_family = AF_INET6;
    everywhere.sin6_port = htons(port);
    auto socket = hold_address(reinterpret_cast<sockaddr const&>(everywhere), sizeof everywhere);
    if (!socket && (errno == EAFNOSUPPORT || errno == EADDRNOTAVAIL)) { // a machine without IPv6
        sockaddr_in any{};
        any.sin_family = AF_INET;
        any.sin_port = htons(port);
        socket = hold_address(reinterpret_cast<sockaddr const&>(any), sizeof any);
    }
    if (!socket)
        return Failure(errc::unavailable,
                       core::concat("port ", std::to_string(port), ": ",
                                    std::error_code(errno, std::generic_category()).message()));
    return std::make_unique<BoundPort>(std::move(socket));
}

} // namespace webots_cloud::adapters
