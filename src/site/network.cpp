#include "network.hpp"

#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

namespace webots_cloud::site {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

boost::system::error_code try_to_listen(tcp::endpoint const& where)
{
    asio::io_context context;
    tcp::acceptor acceptor(context);
    boost::system::error_code failed;
    acceptor.open(where.protocol(), failed);
    if (!failed)
        acceptor.set_option(tcp::acceptor::reuse_address(true), failed);
    if (!failed)
        acceptor.bind(where, failed);
    if (!failed)
        acceptor.listen(1, failed);
    return failed;
}

} // namespace

bool is_taken(std::string const& listen_address, std::uint16_t port)
{
    boost::system::error_code failed;
    auto const address = asio::ip::make_address(listen_address, failed);
    bool const is_localhost = !failed && (address.is_loopback() || address.is_unspecified());
    if (is_localhost &&
        try_to_listen({asio::ip::address_v6::loopback(), port}) == asio::error::address_in_use)
        return true;
    if (!failed)
        failed = try_to_listen({address, port});
    if (failed == asio::error::address_family_not_supported) // a machine without IPv6
        failed = try_to_listen({asio::ip::address_v4::any(), port});
    return failed == asio::error::address_in_use;
}

} // namespace webots_cloud::site
