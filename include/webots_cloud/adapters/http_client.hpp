// Requests and WebSockets to other servers.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/network_config.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <filesystem>
#include <memory>

namespace WEBOTS_CLOUD_API webots_cloud {

/// HTTP over Boost.Beast and OpenSSL: certificates are verified; one connection per server is kept, by TLS
/// for ten minutes at most, so that certificates are verified again and again.
///
/// The file of `config.authorities` is read again when it changes (`log` says so). If it is unusable,
/// requests by https fail: see `check_authorities`.
std::unique_ptr<HttpClient> make_http_client(boost::asio::any_io_executor executor,
                                             HttpClientConfig config = HttpClientConfig(),
                                             Logger log = Logger());

/// WebSockets over Boost.Beast and OpenSSL, without compression. Another side that says nothing is pinged
/// after 30 s; the connection is lost when it has said nothing for 60 s, or when what it said has not been
/// received for that time. It has 5 s to take what is queued, and to answer, when a channel is closed.
///
/// `config`, `log`: as for `make_http_client`.
std::unique_ptr<WebSocketClient> make_websocket_client(boost::asio::any_io_executor executor,
                                                       HttpClientConfig config = HttpClientConfig(),
                                                       Logger log = Logger());

/// Whether a PEM file has certificates that could be trusted.
///
/// Errors: `invalid_config`, naming the file.
result<> check_authorities(std::filesystem::path const& authorities);

} // namespace webots_cloud
