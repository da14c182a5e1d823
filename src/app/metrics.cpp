#include "metrics.hpp"

#include "core/pages/metrics_text.hpp"

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
    text.family("http_connections", "gauge", "Connections that are open, WebSockets and tunnels included.")
        .add(figure(statistics.connections));
    text.family("http_websockets", "gauge", "WebSockets that are open.").add(figure(statistics.websockets));
    text.family("http_tunnels", "gauge", "Browsers that are relayed to other servers now.")
        .add(figure(statistics.tunnels));
    text.family("http_connections_accepted_total", "counter", "Connections that came.")
        .add(figure(statistics.accepted));
    text.family("http_connections_refused_total", "counter",
                "Connections ended at once: too many from one address, or no room.")
        .add(figure(statistics.refused_address), {{"reason", "address_limit"}})
        .add(figure(statistics.refused_no_room), {{"reason", "no_room"}});
    text.family("http_connections_dropped_total", "counter",
                "Connections ended by the server later, by reason.")
        .add(figure(statistics.made_room), {{"reason", "made_room"}})
        .add(figure(statistics.timed_out), {{"reason", "timed_out"}})
        .add(figure(statistics.tls_failures), {{"reason", "tls_failure"}})
        .add(figure(statistics.slow_readers), {{"reason", "slow_reader"}})
        .add(figure(statistics.dead_peers), {{"reason", "dead_peer"}})
        .add(figure(statistics.bad_frames), {{"reason", "bad_frame"}});
    text.family("http_requests_total", "counter", "Requests whose headers were complete and good.")
        .add(figure(statistics.requests));
    text.family("http_requests_refused_total", "counter",
                "Requests that were malformed or too large, by reason.")
        .add(figure(statistics.bad_requests), {{"reason", "malformed"}})
        .add(figure(statistics.refused_bodies), {{"reason", "body"}})
        .add(figure(statistics.long_request_lines), {{"reason", "long_request_line"}})
        .add(figure(statistics.long_headers), {{"reason", "long_headers"}})
        .add(figure(statistics.bad_handshakes), {{"reason", "bad_handshake"}});
    text.family("http_requests_forwarded_total", "counter", "Requests that were passed on to other servers.")
        .add(figure(statistics.forwarded));
    text.family("http_forwarding_failures_total", "counter",
                "Requests that the other server did not answer, by reason.")
        .add(figure(statistics.bad_gateways), {{"reason", "unreachable"}})
        .add(figure(statistics.late_gateways), {{"reason", "timed_out"}});
    text.family("http_upstream_handshakes_total", "counter",
                "TLS handshakes with other servers: full, resumed from an earlier connection, or failed.")
        .add(figure(statistics.upstream_tls_full), {{"result", "full"}})
        .add(figure(statistics.upstream_tls_resumed), {{"result", "resumed"}})
        .add(figure(statistics.upstream_tls_failures), {{"result", "failed"}});
    text.family("http_tunnel_bytes_total", "counter",
                "Bytes that were relayed, from browsers (received) and to them (sent).")
        .add(figure(statistics.tunnel_bytes_received), {{"direction", "received"}})
        .add(figure(statistics.tunnel_bytes_sent), {{"direction", "sent"}});
    return text.take();
}

std::string mail_metrics(OperatorMailStatistics const& statistics)
{
    core::MetricsText text;
    text.family("mails_waiting", "gauge", "Mails to the administrator that are not delivered yet.")
        .add(figure(statistics.waiting));
    text.family("mail_attempts_total", "counter", "Attempts to deliver a mail.")
        .add(figure(statistics.sent), {{"result", "sent"}})
        .add(figure(statistics.failed), {{"result", "failed"}});
    text.family("mails_given_up_total", "counter", "Mails that were never sent; the log has them.")
        .add(figure(statistics.given_up));
    return text.take();
}

} // namespace webots_cloud::app
