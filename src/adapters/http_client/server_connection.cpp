#include "server_connection.hpp"

#include "adapters/names/machine_addresses.hpp"
#include "core/text.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/url/parse.hpp>

#include <openssl/ssl.h>

#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;
using core::concat;

namespace {

constexpr auto no_watch = boost::system::errc::no_space_on_device; // of epoll

result<ServerTarget> parse_server_target(std::string const& text, std::string_view plain,
                                         std::string_view tls)
{
    auto const unusable = [&] {
        return Failure(errc::invalid_url,
                       concat("\"", core::printable(text, 200), "\" is no ", plain, " or ", tls, " URL"));
    };
    auto const url = boost::urls::parse_uri(text);
    if (!url || (url->scheme() != plain && url->scheme() != tls) || url->host().empty())
        return unusable();
    ServerTarget target;
    target.tls = url->scheme() == tls;
    target.host = url->host_address();
    target.port = target.tls ? usual_tls_port : usual_plain_port;
    if (url->has_port())
        target.port = core::parse_port({url->port().data(), url->port().size()});
    if (target.port == 0)
        return unusable();
    auto const path = url->encoded_resource();
    target.path = path.empty() ? "/" : std::string(path.data(), path.size());
    return target;
}

asio::awaitable<result<>> encrypt(EncryptedStream& stream, std::string const& host)
{
    if (!expect_host(stream.native_handle(), host))
        co_return Failure(errc::unavailable, "there is no memory for TLS");
    auto const [error] =
        co_await stream.async_handshake(asio::ssl::stream_base::client, asio::as_tuple(asio::use_awaitable));
    if (error == beast::error::timeout)
        co_return Failure(errc::timed_out, "TLS failed: no answer in time"); // as of one that is busy
    if (!error)
        co_return result<>();
    bool const is_of_openssl = error.category() == asio::error::get_ssl_category();
    auto const openssl_error = is_of_openssl ? static_cast<unsigned long>(error.value()) : 0UL;
    co_return Failure(errc::unreachable,
                      handshake_problem(stream.native_handle(), openssl_error, error.message()));
}

} // namespace

result<ServerTarget> parse_http_target(std::string const& url)
{
    return parse_server_target(url, "http", "https");
}

result<ServerTarget> parse_websocket_target(std::string const& url)
{
    return parse_server_target(url, "ws", "wss");
}

asio::awaitable<result<std::vector<tcp::endpoint>>> ServerDirectory::resolve(ServerTarget const& target,
                                                                             TimePoint deadline)
{
    boost::system::error_code not_numeric;
    auto const& given = target.address.empty() ? target.host : target.address;
    auto const address = asio::ip::make_address(given, not_numeric);
    result<Addresses> addresses;
    if (!not_numeric)
        addresses->push_back(address);
    else
        addresses = co_await resolver_.resolve(given, deadline);
    if (!addresses)
        co_return addresses.error();
    if (target.elsewhere)
        if (auto const kept = keep_those_elsewhere(*addresses, given); !kept)
            co_return kept.error();
    std::vector<tcp::endpoint> endpoints;
    for (auto const& found : *addresses)
        endpoints.emplace_back(found, target.port);
    co_return endpoints;
}

result<asio::ssl::context> ServerDirectory::tls()
{
    auto const trusted = trust_.context();
    if (!trusted)
        return trusted.error();
    SSL_CTX_up_ref(*trusted);
    return asio::ssl::context(*trusted); // a share of its own
}

asio::awaitable<result<>> ServerDirectory::open_connection(PlainStream& lowest, EncryptedStream* encrypted,
                                                           ServerTarget const& target,
                                                           std::vector<tcp::endpoint> addresses)
{
    if (!watches_.may_watch())
        co_return Failure(errc::unreachable, make_error_code(no_watch).message());
    auto const [error, endpoint] =
        co_await lowest.async_connect(addresses, asio::as_tuple(asio::use_awaitable));
    if (error == beast::error::timeout)
        co_return Failure(errc::unreachable, "no connection in time");
    if (error == asio::error::operation_aborted)
        co_return Failure(error);
    if (error == no_watch)
        watches_.has_failed();
    if (error)
        co_return Failure(errc::unreachable, error.message());
    beast::error_code ignored;
    lowest.socket().set_option(tcp::no_delay(true), ignored);
    if (encrypted)
        co_return co_await encrypt(*encrypted, target.host);
    co_return result<>();
}

} // namespace webots_cloud::adapters
