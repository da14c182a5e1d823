#include "metrics.hpp"

#include "core/pages/metrics_text.hpp"

#include <chrono>

namespace webots_cloud::app {
namespace {

double figure(std::uint64_t count) noexcept
{
    return static_cast<double>(count);
}

} // namespace

std::string http_server_metrics(HttpServerStatistics const& statistics)
{
    core::MetricsText text;
    text.family(core::metric("http_connections")).add(figure(statistics.connections));
    text.family(core::metric("http_websockets")).add(figure(statistics.websockets));
    text.family(core::metric("http_tunnels")).add(figure(statistics.tunnels));
    text.family(core::metric("http_connections_accepted_total")).add(figure(statistics.accepted));
    text.family(core::metric("http_connections_refused_total"))
        .add(figure(statistics.refused_address), {{"reason", "address_limit"}})
        .add(figure(statistics.refused_no_room), {{"reason", "no_room"}});
    text.family(core::metric("http_connections_dropped_total"))
        .add(figure(statistics.made_room), {{"reason", "made_room"}})
        .add(figure(statistics.timed_out), {{"reason", "timed_out"}})
        .add(figure(statistics.tls_failures), {{"reason", "tls_failure"}})
        .add(figure(statistics.slow_readers), {{"reason", "slow_reader"}})
        .add(figure(statistics.dead_peers), {{"reason", "dead_peer"}})
        .add(figure(statistics.bad_frames), {{"reason", "bad_frame"}});
    text.family(core::metric("http_requests_total")).add(figure(statistics.requests));
    text.family(core::metric("http_requests_refused_total"))
        .add(figure(statistics.bad_requests), {{"reason", "malformed"}})
        .add(figure(statistics.refused_bodies), {{"reason", "body"}})
        .add(figure(statistics.long_request_lines), {{"reason", "long_request_line"}})
        .add(figure(statistics.long_headers), {{"reason", "long_headers"}})
        .add(figure(statistics.bad_handshakes), {{"reason", "bad_handshake"}});
    text.family(core::metric("http_requests_forwarded_total")).add(figure(statistics.forwarded));
    text.family(core::metric("http_forwarding_failures_total"))
        .add(figure(statistics.bad_gateways), {{"reason", "unreachable"}})
        .add(figure(statistics.late_gateways), {{"reason", "timed_out"}});
    text.family(core::metric("http_upstream_handshakes_total"))
        .add(figure(statistics.upstream_tls_full), {{"result", "full"}})
        .add(figure(statistics.upstream_tls_resumed), {{"result", "resumed"}})
        .add(figure(statistics.upstream_tls_failures), {{"result", "failed"}});
    if (statistics.certificate_expires)
        text.family(core::metric("http_certificate_expiry_timestamp_seconds"))
            .add(static_cast<double>(std::chrono::system_clock::to_time_t(*statistics.certificate_expires)));
    text.family(core::metric("http_tunnel_bytes_total"))
        .add(figure(statistics.tunnel_bytes_received), {{"direction", "received"}})
        .add(figure(statistics.tunnel_bytes_sent), {{"direction", "sent"}});
    return text.take();
}

std::string mail_metrics(OperatorMailStatistics const& statistics)
{
    core::MetricsText text;
    text.family(core::metric("mails_waiting")).add(figure(statistics.waiting));
    text.family(core::metric("mail_attempts_total"))
        .add(figure(statistics.sent), {{"result", "sent"}})
        .add(figure(statistics.failed), {{"result", "failed"}});
    text.family(core::metric("mails_given_up_total")).add(figure(statistics.given_up));
    return text.take();
}

} // namespace webots_cloud::app
