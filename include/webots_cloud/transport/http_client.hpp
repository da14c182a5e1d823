// Requests to other servers as a seam: polls of simulation servers, and the registry.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// One request to another server.
struct HttpRequest
{
    HttpRequest() = default;
    explicit HttpRequest(std::string url) : url(std::move(url)) {}

    std::string method = "GET";
    std::string url; ///< `http://` or `https://`, absolute.
    /// Numeric: where to connect, unless empty, instead of the addresses of the URL's host. The certificate
    /// has to be for that host all the same.
    std::string address;
    /// The server is known to be on another machine: addresses of the loopback, and others that no machine
    /// can have, are left out, whatever its name means.
    bool elsewhere = false;
    HttpHeaders headers;
    std::string body;
    /// For the whole exchange: name, connection, TLS and answer.
    Duration timeout = std::chrono::seconds(5);
    /// Bytes; an answer with a longer body is `errc::too_large`, read no further.
    std::size_t body_limit = 64 * 1024;
};

/// Sends a request and returns the answer, whatever its status. Redirects are not followed.
///
/// Contract: many requests may be in flight at once; two to the same server at the same time need not share a
/// connection. A connection may be kept for the next request to the same server.
/// Cancellation: terminal; the exchange is abandoned and `operation_aborted` reported.
/// Errors: `invalid_url`; `unreachable` (name or connection: refused, or not in time; TLS: refused);
/// `timed_out` (TLS, or the answer); `too_large`; `protocol_error` (the peer does not speak HTTP or closes
/// before the end of its answer).
/// Thread-safety: one executor.
class HttpClient
{
public:
    virtual ~HttpClient() = default;
    virtual boost::asio::awaitable<result<HttpResponse>> send(HttpRequest request) = 0;
};

} // namespace webots_cloud
