// All metrics of both servers: what /metrics says of each, and docs/metrics.md, which is made from this
// table.
#pragma once

#include <algorithm>
#include <array>
#include <string_view>

namespace webots_cloud::core {

enum class MetricType
{
    counter,  ///< Only grows; begins with 0 when the server starts. Its name ends with `_total`.
    gauge,    ///< Goes up and down.
    histogram ///< Counts of values by how large they were.
};

enum class MetricServer
{
    both,
    session,
    simulation
};

struct Metric
{
    /// Behind `webots_`. It ends with the unit, if there is one: `seconds`, `bytes`, or `ratio`, where 1 is
    /// all.
    std::string_view name;
    MetricType type;
    MetricServer server;
    std::string_view labels; ///< Their names; empty: none.
    std::string_view
        needs; ///< Without this it is not there, mostly a key of the configuration; empty: nothing.
    std::string_view help; ///< One sentence.
};

// tests/hygiene/metrics_page.py reads these lines: an entry is one line, or has its help on a second one.
inline constexpr auto all_metrics = [] {
    using enum MetricType;
    using enum MetricServer;
    // clang-format off
    return std::to_array<Metric>({
        {"build_info", gauge, both, "version", "", "Always 1; the version is the label."},
        {"http_connections", gauge, both, "", "", "Connections that are open, WebSockets and tunnels included."},
        {"http_websockets", gauge, both, "", "", "WebSockets that are open."},
        {"http_tunnels", gauge, both, "", "", "Browsers that are relayed to other servers now."},
        {"http_connections_accepted_total", counter, both, "", "", "Connections that came."},
        {"http_connections_refused_total", counter, both, "reason", "", "Connections ended at once: too many from one address, or no room."},
        {"http_connections_dropped_total", counter, both, "reason", "", "Connections ended by the server later, by reason."},
        {"http_requests_total", counter, both, "", "", "Requests whose headers were complete and good."},
        {"http_requests_refused_total", counter, both, "reason", "", "Requests that were malformed or too large, by reason."},
        {"http_requests_forwarded_total", counter, both, "", "", "Requests that were passed on to other servers."},
        {"http_forwarding_failures_total", counter, both, "reason", "", "Requests that the other server did not answer, by reason."},
        {"http_upstream_handshakes_total", counter, both, "result", "", "TLS handshakes with other servers: full, resumed from an earlier connection, or failed."},
        {"http_certificate_expiry_timestamp_seconds", gauge, both, "", "sslCertificate", "When the server's certificate expires, in seconds since 1970."},
        {"http_tunnel_bytes_total", counter, both, "direction", "", "Bytes that the HTTP port relayed, to other servers or simulations, from browsers (received) and to them (sent)."},

        {"servers", gauge, session, "state", "", "Simulation servers by what their last poll said."},
        {"servers_drained", gauge, session, "", "", "Simulation servers that the operator has drained here."},
        {"available", gauge, session, "", "", "1 while a simulation server would take a session."},
        {"site_state", gauge, session, "state", "", "1 for what the site is for somebody who comes now; 0 for the other states."},
        {"availability_watchers", gauge, session, "", "", "Browsers that are told about availability."},
        {"placements_total", counter, session, "result", "", "Requests for a simulation server."},
        {"polls_total", counter, session, "result", "", "Polls of simulation servers."},
        {"machine_up", gauge, session, "machine", "", "1 while polls of the machine succeed; absent before the first one has ended."},
        {"machine_load_ratio", gauge, session, "machine", "", "The load that the machine reports; 1 is full. Absent while it is not up, as are the next two."},
        {"machine_simulations", gauge, session, "machine", "", "Simulations that the machine reports, those that start included."},
        {"machine_simulations_max", gauge, session, "machine", "", "Simulations that the machine would run at once."},
        {"machine_drained", gauge, session, "machine", "", "1 while the machine gets no new sessions: by the operator, the configuration, or itself."},
        {"machine_placements_total", counter, session, "machine", "", "Sessions that were placed on the machine."},
        {"waiting", gauge, session, "", "relay", "Browsers that wait for a machine."},
        {"waiting_max", gauge, session, "", "relay", "Browsers that may wait at once."},
        {"waiting_longest_seconds", gauge, session, "", "relay", "How long the one that has waited longest has waited."},
        {"waiting_seconds", histogram, session, "", "relay", "How long browsers waited until there was a machine."},
        {"waiting_given_up_total", counter, session, "", "relay", "Browsers that left while they waited."},
        {"waiting_refused_total", counter, session, "", "relay", "Browsers for which there was no place to wait."},
        {"relayed", gauge, session, "", "relay", "Browsers whose messages are relayed to a machine."},
        {"relay_attempts_total", counter, session, "result", "relay", "What became of browsers on the machines to which they were relayed."},
        {"relay_questions_total", counter, session, "", "relay", "Reports that machines were asked for before a browser was placed, where other session servers place too."},
        {"classes", gauge, session, "", "", "Classes that teachers have opened."},
        {"class_students", gauge, session, "", "", "Students of all classes."},
        {"class_seats_held", gauge, session, "", "", "Seats that are held back for students who have not come yet."},
        {"class_pictures_total", counter, session, "result", "", "Pictures of students, for windows of their teachers."},
        {"mails_waiting", gauge, session, "", "", "Mails to the administrator that are not delivered yet."},
        {"mail_attempts_total", counter, session, "result", "", "Attempts to deliver a mail."},
        {"mails_given_up_total", counter, session, "", "", "Mails that were never sent; the log has them."},

        {"load_ratio", gauge, simulation, "", "", "The load that GET /load answers; 1 is full."},
        {"memory_used_ratio", gauge, simulation, "", "", "Memory in use, of the machine's or of what the control group allows."},
        {"disk_used_ratio", gauge, simulation, "", "", "Use of the root file system."},
        {"simulations", gauge, simulation, "state", "", "Simulations by state."},
        {"simulations_staged", gauge, simulation, "", "", "Staged simulations that are ready for a browser."},
        {"staged_taken_total", counter, simulation, "", "", "Browsers that got a staged simulation."},
        {"simulations_max", gauge, simulation, "", "", "Simulations that may run at once."},
        {"draining", gauge, simulation, "", "", "1 while no new simulation is taken."},
        {"simulations_isolated", gauge, simulation, "", "", "1 where the kernel keeps simulations from the server and from each other."},
        {"event_loop_lag_seconds", gauge, simulation, "", "", "How late the last measurement of the machine was."},
        {"event_loop_lag_max_seconds", gauge, simulation, "", "", "The highest of the last 60 measurements."},
        {"starts_total", counter, simulation, "result, reason", "", "Simulations that browsers asked for, by how that ended; of failed ones why: refused (not allowed, or ended by the operator), full (this server can't now), not_found ..."},
        {"start_stage_seconds", histogram, simulation, "stage", "", "How long the stages of starts took that were completed."},
        {"prefetches_total", counter, simulation, "result, reason", "", "Projects that were to be fetched for later starts, by how that ended."},
        {"simulations_memory_bytes", gauge, simulation, "", "a limit on simulations", "Memory of all simulations together."},
        {"simulations_processes", gauge, simulation, "", "a limit on simulations", "Processes and threads of all simulations together."},
        {"simulations_processors", gauge, simulation, "", "a limit on simulations", "Processors that simulations keep busy."},
        {"simulations_graphics_processors", gauge, simulation, "", "graphics processors whose driver tells who uses them", "Graphics processors that simulations keep busy."},
        {"simulations_over_limit_total", counter, simulation, "limit", "a limit on simulations", "Simulations that were ended at a limit."},
        {"gateway_connections", gauge, simulation, "", "gateway", "Connections to simulations for browsers."},
        {"gateway_bytes_total", counter, simulation, "from", "gateway", "Bytes relayed between simulations and their browsers, controllers on other machines included, by who sent them."},
    });
    // clang-format on
}();

/// The entry of that name. A name that is not in the table does not compile.
consteval Metric const& metric(std::string_view name)
{
    auto const found = std::find_if(all_metrics.begin(), all_metrics.end(),
                                    [name](Metric const& each) { return each.name == name; });
    if (found == all_metrics.end())
        throw "no such metric";
    return *found;
}

} // namespace webots_cloud::core
