// What the connections to other servers have in common: whom they trust, and what is remembered of earlier
// ones.
#pragma once

#include "adapters/names/name_resolver.hpp"
#include "adapters/network/network_stream.hpp"
#include "adapters/network/watch_reserve.hpp"
#include "adapters/tls/tls_trust.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <tuple>

struct ssl_session_st; // of OpenSSL

namespace webots_cloud::adapters {

struct TlsSessionDeleter
{
    void operator()(ssl_session_st* session) const noexcept;
};

using TlsSession = std::unique_ptr<ssl_session_st, TlsSessionDeleter>;

/// Of each server one TLS session is kept, so that further connections cost no signature. After ten minutes,
/// and when "caFile" has changed, the next connection verifies the certificate anew.
///
/// Thread-safety: one executor.
class Upstreams
{
public:
    /// `params` and `statistics` must outlive it.
    Upstreams(boost::asio::any_io_executor const& executor, HttpServerParams const& params,
              HttpServerStatistics& statistics, Logger log);

    /// Cancellation, errors: as `NameResolver::resolve`.
    boost::asio::awaitable<result<Addresses>> resolve(std::string name);

    /// Of connections to other servers.
    WatchReserve& watches() noexcept { return watches_; }

    /// For a connection to a server, before its handshake.
    ///
    /// Errors: as `load_trust`; `unavailable`.
    result<TlsConnection> begin(Upstream const& upstream);

    void count_handshake(SSL const* tls) noexcept;
    void count_failure() noexcept { ++statistics_.upstream_tls_failures; }

    /// Remembers the session of a connection that the server has answered on.
    void keep_session(Upstream const& upstream, SSL* tls);

private:
    struct Session
    {
        TlsSession session;
        TimePoint verified; ///< When the server's certificate was.
    };
    using Server = std::tuple<std::string, std::uint16_t, std::string>; ///< Host, port, name.

    HttpServerParams const& params_;
    HttpServerStatistics& statistics_;
    TlsTrust trust_;
    SSL_CTX* trusted_by_ = nullptr; ///< The context of the sessions, which is compared and never used.
    NameResolver resolver_;
    WatchReserve watches_;
    std::map<Server, Session> sessions_;
};

} // namespace webots_cloud::adapters
