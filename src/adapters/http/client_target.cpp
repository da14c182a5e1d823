#include "client_target.hpp"

#include "core/text.hpp"

#include <boost/url/parse.hpp>

namespace webots_cloud::adapters {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using core::concat;

constexpr std::uint16_t plain_port = 80;
constexpr std::uint16_t tls_port = 443;

} // namespace

result<Target> parse_target(std::string const& text, UrlScheme scheme)
{
    bool const is_http = scheme == UrlScheme::http;
    auto const unusable = [&text, is_http] {
        return Failure(errc::invalid_url, concat("\"", core::printable(text, 200), "\" is no ",
                                                 is_http ? "http or https" : "ws or wss", " URL"));
    };
    auto const url = boost::urls::parse_uri(text);
    if (!url || url->host().empty())
        return unusable();
    Target target;
    target.tls = url->scheme() == (is_http ? "https" : "wss");
    if (!target.tls && url->scheme() != (is_http ? "http" : "ws"))
        return unusable();
    target.host = url->host_address();
    target.port = target.tls ? tls_port : plain_port;
    if (url->has_port())
        target.port = core::parse_port({url->port().data(), url->port().size()});
    if (target.port == 0)
        return unusable();
    auto const path = url->encoded_resource();
    target.path = path.empty() ? "/" : std::string(path.data(), path.size());
    return target;
}

void append_authority(std::string& text, Target const& target)
{
    bool const is_v6 = target.host.find(':') != std::string::npos;
    text.append(is_v6 ? "[" : "").append(target.host).append(is_v6 ? "]" : "");
    if (target.port != (target.tls ? tls_port : plain_port))
        text.append(":").append(std::to_string(target.port));
}

asio::awaitable<result<std::vector<tcp::endpoint>>> endpoints_of(NameResolver& resolver, Target const& target,
                                                                 TimePoint deadline)
{
    std::vector<tcp::endpoint> endpoints;
    boost::system::error_code not_numeric;
    auto const address = asio::ip::make_address(target.host, not_numeric);
    if (!not_numeric) {
        endpoints.emplace_back(address, target.port);
        co_return endpoints;
    }
    auto const addresses = co_await resolver.resolve(target.host, deadline);
    if (!addresses)
        co_return addresses.error();
    for (auto const& found : *addresses)
        endpoints.emplace_back(found, target.port);
    co_return endpoints;
}

} // namespace webots_cloud::adapters
