// Where a client connects to: the parts of a URL, and the addresses behind its name.
#pragma once

#include "name_resolver.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

enum class UrlScheme
{
    http,     ///< `http://` and `https://`
    websocket ///< `ws://` and `wss://`
};

struct Target
{
    Target() = default;

    bool tls = false;
    std::string host; ///< Without brackets.
    std::uint16_t port = 0;
    std::string path; ///< And the query; never empty.
};

/// Errors: `invalid_url`.
result<Target> parse_target(std::string const& url, UrlScheme scheme);

/// As in the `Host` header: the port is left out where it is the usual one.
void append_authority(std::string& text, Target const& target);

/// Errors: as `NameResolver::resolve`.
boost::asio::awaitable<result<std::vector<boost::asio::ip::tcp::endpoint>>>
endpoints_of(NameResolver& resolver, Target const& target, TimePoint deadline);

} // namespace webots_cloud::adapters
