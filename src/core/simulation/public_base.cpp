#include "public_base.hpp"

#include "core/public_place.hpp"
#include "core/text.hpp"

#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>

namespace webots_cloud::core {
namespace {

constexpr std::size_t longest = 400; // a host of 253 characters, a port, a path, and those of two gateways

} // namespace

std::string public_base(PublicAddress const& address)
{
    return concat(address.ssl ? "wss://" : "ws://", public_place(address));
}

std::optional<std::string> parse_public_base(std::string_view text)
{
    if (text.size() > longest || (!text.starts_with("ws://") && !text.starts_with("wss://")))
        return std::nullopt;
    auto const url = boost::urls::parse_uri(text);
    if (!url || url->has_userinfo() || url->has_query() || url->has_fragment() || url->encoded_host().empty())
        return std::nullopt;
    auto const path = url->encoded_path();
    return path.empty() || is_site_path({path.data(), path.size()}) ? std::optional(std::string(text))
                                                                    : std::nullopt;
}

} // namespace webots_cloud::core
