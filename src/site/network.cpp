#include "network.hpp"

#include "core/access/ip_address.hpp"

#include <boost/asio/error.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <algorithm>
#include <array>
#include <memory>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>

namespace webots_cloud::site {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

/// Of containers and virtual machines.
constexpr std::array<std::string_view, 7> inner_interfaces{"docker", "br-",    "veth", "virbr",
                                                           "lxc",    "podman", "cni"};

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

std::vector<std::string> shared_addresses(std::vector<InterfaceAddress> const& all)
{
    static auto const loopback = core::IpNetwork::parse("127.0.0.0/8");
    static auto const link_local = core::IpNetwork::parse("169.254.0.0/16");
    std::vector<std::string> shared;
    for (auto const& each : all) {
        auto const address = core::IpAddress::parse(each.address);
        bool const is_inner = std::ranges::any_of(inner_interfaces, [&](std::string_view name) {
            return std::string_view(each.interface).starts_with(name);
        });
        if (address && !is_inner && !loopback->contains(*address) && !link_local->contains(*address))
            shared.push_back(each.address);
    }
    return shared;
}

std::vector<InterfaceAddress> interface_addresses()
{
    ifaddrs* first = nullptr;
    if (::getifaddrs(&first) != 0)
        return {};
    std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> const all(first, ::freeifaddrs);
    std::vector<InterfaceAddress> addresses;
    for (auto const* each = first; each; each = each->ifa_next) {
        std::array<char, INET_ADDRSTRLEN> text{};
        if (!each->ifa_addr || each->ifa_addr->sa_family != AF_INET || (each->ifa_flags & IFF_UP) == 0)
            continue;
        auto const* const address = reinterpret_cast<sockaddr_in const*>(each->ifa_addr);
        if (::inet_ntop(AF_INET, &address->sin_addr, text.data(), text.size()))
            addresses.emplace_back(each->ifa_name, text.data());
    }
    return addresses;
}

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
