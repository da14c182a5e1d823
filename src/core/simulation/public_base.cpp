#include "public_base.hpp"

#include "core/text.hpp"

#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::size_t longest = 400; // a host of 253 characters, a port, and the paths of two gateways

/// Below `/`: what our gateways add, and what proxies of other sites may.
bool is_plain_path(std::string_view path)
{
    return !path.ends_with('/') && std::all_of(path.begin(), path.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '/' ||
               c == '-' || c == '_';
    });
}

} // namespace

std::string public_base(PublicAddress const& address)
{
    return concat(address.ssl ? "wss://" : "ws://", address.host, address.port_rewrite ? "/" : ":",
                  std::to_string(address.port));
}

std::optional<std::string> parse_public_base(std::string_view text)
{
    if (text.size() > longest || (!text.starts_with("ws://") && !text.starts_with("wss://")))
        return std::nullopt;
    auto const url = boost::urls::parse_uri(text);
    if (!url || url->has_userinfo() || url->has_query() || url->has_fragment() || url->encoded_host().empty())
        return std::nullopt;
    auto const path = url->encoded_path();
    return is_plain_path({path.data(), path.size()}) ? std::optional(std::string(text)) : std::nullopt;
}

} // namespace webots_cloud::core
