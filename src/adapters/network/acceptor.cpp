// Accepts connections while there are descriptors, and watches of epoll, for them. Those for which there is
// none are turned away with a descriptor kept for that, instead of being left to wait.
#include "acceptor.hpp"

#include "core/text.hpp"

#include <boost/asio/ip/v6_only.hpp>

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using asio::ip::tcp;
using core::concat;

namespace {

// What the kernel takes of an answer before its turn to be sent. Without a limit it is some hundred kilobytes
// for each client that does not read, which would look as if the answer had been taken.
constexpr int max_unsent = 16 * 1024;

int take_descriptor()
{
    return ::open("/dev/null", O_RDONLY | O_CLOEXEC);
}

/// What follows the kernel's own words.
std::string remedy(boost::system::error_code const& error, tcp::endpoint const& where)
{
    constexpr int first_of_all = 1024; // unless somebody has changed it
    if (error == asio::error::address_in_use)
        return ". Is a server running there already?";
    if (error == asio::error::access_denied)
        return concat(where.port() < first_of_all ? ". Ports below 1024 are root's"
                                                  : ". net.ipv4.ip_unprivileged_port_start makes it root's",
                      ", or of services with the capability CAP_NET_BIND_SERVICE");
    if (error.value() == EADDRNOTAVAIL)
        return concat(
            ". ", where.address().to_string(),
            " is none of this machine's addresses now. `ip address` shows them: name one of them in "
            "the configuration, or \"::\", which is all");
    return {};
}

} // namespace

result<> Acceptor::open(tcp::endpoint const& where)
{
    boost::system::error_code error;
    protocol_ = where.protocol();
    acceptor_.open(where.protocol(), error);
    if (!error)
        acceptor_.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error && where.protocol() == tcp::v6())
        acceptor_.set_option(asio::ip::v6_only(false), error);
    if (!error)
        acceptor_.bind(where, error);
    if (!error) // what is accepted inherits it; a kernel that does not know it takes more
        (void)::setsockopt(acceptor_.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &max_unsent,
                           sizeof max_unsent);
    if (!error)
        acceptor_.native_non_blocking(true, error); // for `take`
    if (!error)
        acceptor_.listen(asio::socket_base::max_listen_connections, error);
    if (!error)
        return {};
    boost::system::error_code ignored;
    acceptor_.close(ignored);
    // Another program may end, and an address come with its network; permissions stay as they are.
    return Failure(error == asio::error::access_denied ? errc::invalid_argument : errc::unavailable,
                   concat("can't listen on port ", std::to_string(where.port()), ": ", error.message(),
                          remedy(error, where)));
}

result<> Acceptor::listen(std::string const& address, std::uint16_t port)
{
    boost::system::error_code error;
    auto const where = asio::ip::make_address(address, error);
    if (error)
        return Failure(errc::invalid_argument,
                       concat("\"", address, "\" is not a numeric address to listen on"));
    auto opened = open({where, port});
    // A machine without IPv6 still has every IPv4 address.
    if (!opened && where == asio::ip::address_v6::any())
        opened = open({asio::ip::address_v4::any(), port});
    if (opened)
        reserve_ = take_descriptor();
    return opened;
}

boost::system::error_code Acceptor::take(tcp::socket& socket)
{
    constexpr int max_tries = 64; // others may be faster than we are
    FileDescriptor taken(
        ::accept4(acceptor_.native_handle(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!taken)
        return {errno, boost::system::system_category()};
    boost::system::error_code error(ENOSPC, boost::system::system_category());
    // Each connection needs a watch of epoll. Without one, another try lets go of one of the reserve.
    bool is_tried = watches_.may_watch();
    for (int i = 0; is_tried && i < max_tries; ++i) {
        socket.assign(protocol_, taken.get(), error);
        if (error != boost::system::errc::no_space_on_device)
            break;
        watches_.has_failed();
        is_tried = watches_.find_free();
    }
    if (!error)
        (void)taken.release();
    return error;
}

bool Acceptor::turn_away()
{
    if (reserve_ < 0)
        return false;
    // Accepting takes a descriptor: that one. Unaccepted, the client would wait in vain.
    ::close(reserve_);
    int const turned_away =
        ::accept4(acceptor_.native_handle(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (turned_away >= 0)
        ::close(turned_away);
    reserve_ = take_descriptor();
    return turned_away >= 0;
}

void Acceptor::close()
{
    boost::system::error_code ignored;
    acceptor_.close(ignored);
    if (reserve_ >= 0)
        ::close(reserve_);
    reserve_ = -1;
}

std::size_t affordable_connections(std::size_t spare)
{
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return SIZE_MAX;
    auto const all = static_cast<std::size_t>(limit.rlim_cur);
    return all - std::min(spare, all / 2);
}

} // namespace webots_cloud::adapters
