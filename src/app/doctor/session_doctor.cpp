// The checks of the session server: its machines, its mail, and what both servers have in common
// (checks.cpp). What a reading means is decided in core/doctor.
#include "aside.hpp"
#include "doctors.hpp"
#include "service_view.hpp"

#include "adapters/mail/mail_probe.hpp"
#include "app/daemon.hpp"
#include "core/access/forwarding.hpp"
#include "core/discovery/named_machines.hpp"
#include "core/doctor/network_findings.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/http_client.hpp>
#include <webots_cloud/adapters/names.hpp>

namespace webots_cloud::app {
namespace {

namespace asio = boost::asio;
using core::concat;
using core::Findings;

constexpr std::uint64_t wanted_memory = std::uint64_t{64} << 20; // docs/machine.md, without its clients
constexpr std::uint64_t wanted_files = 4096;                     // some thousand browsers
constexpr std::uint16_t usual_mail_port = 25;
constexpr std::size_t max_examined = 3; // of the machines of one name, one after the other

std::uint16_t port_of(bool tls)
{
    return tls ? 443 : 80;
}

CheckWork check_machine(HttpClient& http, ServerSpec server, bool tls)
{
    HttpRequest request(concat(tls ? "https://" : "http://", server.address, "/load"));
    if (!server.internal_address.empty()) {
        auto inside = core::internal_request(server.internal_address, server.internal_name, "/load");
        request.url = std::move(inside.url);
        request.address = std::move(inside.address);
    }
    request.timeout = answer_limit;
    auto const answer = co_await http.send(std::move(request));
    result<LoadReport> report = LoadReport();
    if (!answer)
        report = answer.error();
    else if (answer->status != 200)
        report = Failure(errc::protocol_error,
                         concat("HTTP status ", std::to_string(answer->status), " from /load"));
    else
        report = parse_load_report(answer->body);
    bool const is_proxied = server.internal_address.empty() && server.address.find('/') != std::string::npos;
    Findings findings{core::judge_simulation_server(server.address, report, is_proxied ? port_of(tls) : 0)};
    co_return findings;
}

/// The machines that a name stands for: the first of them are examined.
CheckWork check_named_machines(HttpClient& http, NameService& names, ServerSpec entry, bool tls,
                               bool loopback)
{
    auto const name = core::parse_machine_name(entry.address).value_or(core::MachineName());
    auto const now = std::chrono::steady_clock::now();
    auto asking = name.is_service ? names.services(name.name, now + answer_limit)
                                  : names.addresses(name.name, now + answer_limit);
    auto const answer = co_await std::move(asking);
    core::NamedMachines named(entry, name);
    auto const news = named.take(answer, now, loopback);
    auto machines = named.machines();
    Findings findings{core::judge_machine_name(entry.address, machines.size(), news.warning)};
    if (machines.size() > max_examined)
        machines.resize(max_examined);
    for (auto const& machine : machines) {
        auto const more = co_await check_machine(http, machine, tls);
        findings.insert(findings.end(), more.begin(), more.end());
    }
    co_return findings;
}

CheckWork check_mail(SessionConfig config)
{
    auto mail = config.mail;
    mail.timeout = answer_limit;
    auto const address =
        concat(mail.server, ":", std::to_string(mail.server_port == 0 ? usual_mail_port : mail.server_port));
    std::function<result<bool>()> const look = [mail = std::move(mail), name = config.address.host] {
        auto const tried = adapters::try_mail_server(mail, name);
        return tried ? result<bool>(true) : result<bool>(tried.error());
    };
    auto const tried = co_await aside<bool>(look);
    Findings findings{core::judge_mail_server(address, tried ? result<>() : result<>(tried.error()))};
    co_return findings;
}

} // namespace

CheckWork examine_session_server(SessionConfig config, Viewpoint viewpoint, asio::any_io_executor executor,
                                 Progress progress)
{
    auto const clock = make_steady_clock(executor);
    auto const http = make_http_client(executor, config.http_client);
    auto findings = port_findings(config.address.port, config.network, viewpoint.is_running);
    for (auto& each : machine_findings(wanted_memory, wanted_files))
        findings.push_back(std::move(each));
    auto const names = make_name_service(executor);
    auto checks = common_checks(folders_of(config), log_file_of(config), config.network, config.address,
                                viewpoint, *http, *names);
    // Names of machines may have name servers of their own; all else is looked up as the system does.
    auto const machine_names = make_name_service(executor, config.name_servers);
    for (auto const& server : config.simulation_servers) {
        if (server.address == core::announced_entry)
            continue;
        checks.emplace_back(concat("machine ", server.address),
                            core::is_machine_name(server.address)
                                ? check_named_machines(*http, *machine_names, server, config.address.ssl,
                                                       config.discover_loopback)
                                : check_machine(*http, server, config.address.ssl));
    }
    if (!config.mail.administrator.empty())
        checks.emplace_back("mail", check_mail(config));
    auto more = co_await examine(std::move(checks), *clock, std::move(progress));
    findings.insert(findings.end(), more.begin(), more.end());
    co_return findings;
}

Findings diagnose_session_server(Arguments const& arguments, Progress progress)
{
    Findings findings;
    auto const config = read_for_doctor<SessionConfig>(arguments, parse_session_config, findings);
    if (!config || !can_wait(findings))
        return findings;
    auto const port = config->address.port;
    auto const viewpoint = view_from_outside("session", port, config->access);
    auto seen = view_of_service("session", arguments, viewpoint.socket);
    asio::io_context context;
    if (seen.is_complete) {
        run_to_end(findings_of_root(wanted_memory, port), context, seen.findings);
        return seen.findings;
    }
    findings.insert(findings.begin(), seen.findings.begin(), seen.findings.end());
    run_to_end(examine_session_server(*config, viewpoint, context.get_executor(), std::move(progress)),
               context, findings);
    return findings;
}

} // namespace webots_cloud::app
