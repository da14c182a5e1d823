#include "upstreams.hpp"

#include <openssl/ssl.h>

#include <utility>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

namespace {

// A certificate that has expired is found out that soon.
constexpr auto session_is_good_for = std::chrono::minutes(10);
// More servers than a session server has: what others leave when the configuration changes is forgotten.
constexpr std::size_t max_servers = 4096;

/// OpenSSL takes it that a session whose connection ends without a farewell must not be resumed, for all who
/// share the session. Bytes that were cut off are found out by HTTP, so each connection has its own.
TlsSession copy_of(SSL_SESSION const* session)
{
    return TlsSession(session ? SSL_SESSION_dup(session) : nullptr);
}

TimePoint now()
{
    return std::chrono::steady_clock::now();
}

} // namespace

void TlsSessionDeleter::operator()(SSL_SESSION* session) const noexcept
{
    SSL_SESSION_free(session);
}

Upstreams::Upstreams(asio::any_io_executor const& executor, HttpServerParams const& params,
                     HttpServerStatistics& statistics, Logger log)
    : params_(params), statistics_(statistics), trust_(params.tls_authorities, std::move(log)),
      resolver_(executor)
{
    if (!params_.tls_authorities.empty())
        (void)trust_.context(); // while the file is as it was checked; `begin` says what is wrong with it
}

asio::awaitable<result<Addresses>> Upstreams::resolve(std::string name)
{
    return resolver_.resolve(std::move(name), now() + params_.connect_timeout);
}

result<TlsConnection> Upstreams::begin(Upstream const& upstream)
{
    auto const context = trust_.context();
    if (!context)
        return context.error();
    // Sessions were verified by the authorities of then: others are trusted now.
    if (std::exchange(trusted_by_, *context) != *context)
        sessions_.clear();
    TlsConnection tls(SSL_new(*context));
    if (!tls || !expect_host(tls.get(), upstream.name.empty() ? upstream.host : upstream.name))
        return Failure(errc::unavailable, "there is no memory for TLS");
    SSL_set_connect_state(tls.get());
    auto const known = sessions_.find(Server(upstream.host, upstream.port, upstream.name));
    if (known == sessions_.end())
        return tls;
    if (now() - known->second.verified < session_is_good_for)
        SSL_set_session(tls.get(), copy_of(known->second.session.get()).get());
    else
        sessions_.erase(known);
    return tls;
}

void Upstreams::count_handshake(SSL const* tls) noexcept
{
    ++(SSL_session_reused(tls) == 1 ? statistics_.upstream_tls_resumed : statistics_.upstream_tls_full);
}

void Upstreams::keep_session(Upstream const& upstream, SSL* tls)
{
    auto session = copy_of(SSL_get_session(tls));
    if (!session || SSL_SESSION_is_resumable(session.get()) != 1 || SSL_get_SSL_CTX(tls) != trusted_by_)
        return;
    Server const server(upstream.host, upstream.port, upstream.name);
    auto const known = sessions_.find(server);
    if (SSL_session_reused(tls) == 1) { // its certificate was verified with the first of these sessions
        if (known != sessions_.end())
            known->second.session = std::move(session);
        return;
    }
    if (known == sessions_.end() && sessions_.size() >= max_servers)
        sessions_.clear();
    auto& kept = sessions_[server];
    kept.session = std::move(session);
    kept.verified = now();
}

} // namespace webots_cloud::adapters
