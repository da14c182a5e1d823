// The other end of a connection.
#pragma once

#include "core/access/client_address.hpp"

#include <boost/asio/ip/address.hpp>

#include <string>

namespace webots_cloud::adapters {

struct Peer
{
    Peer(boost::asio::ip::address const& from, core::IpNetworks const& proxies)
    {
        namespace ip = boost::asio::ip;
        auto const v6 = from.is_v4() ? ip::make_address_v6(ip::v4_mapped, from.to_v4()) : from.to_v6();
        core::IpAddress const ours(v6.to_bytes());
        address = ours.text();
        if (!proxies.contains(ours))
            quota_key = ours.quota_key();
    }

    bool is_proxy() const noexcept { return quota_key.empty(); }

    /// Whose turn a connection takes: a proxy's are its own.
    std::string const& client() const noexcept { return is_proxy() ? address : quota_key; }

    std::string address;   ///< Numeric, without port.
    std::string quota_key; ///< By what it is counted; empty for a trusted proxy.
};

} // namespace webots_cloud::adapters
