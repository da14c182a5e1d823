// Turns readings of ports, certificates and other servers into findings with a remedy. Nothing is read here,
// so that each sentence can be tested; the readings come from src/app/doctor.
#include "network_findings.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <charconv>
#include <chrono>

namespace webots_cloud::core {
namespace {

constexpr auto renewal_is_late = std::chrono::hours(24 * 14); // Let's Encrypt's are renewed 30 days before
constexpr int server_error = 500;
constexpr std::string_view only_digits = "0123456789";

std::string days(Duration duration)
{
    auto const number = std::chrono::duration_cast<std::chrono::hours>(duration).count() / 24;
    return concat(std::to_string(number), number == 1 ? " day" : " days");
}

/// Where a rule's `words` name a port, alone, in a set or in a range: `2000`, `80,443`, `1999-2100`,
/// `1999:2100`.
bool names(std::string_view words, std::uint16_t port)
{
    while (!words.empty()) {
        auto const begin = words.find_first_of(only_digits);
        if (begin == std::string_view::npos)
            return false;
        words.remove_prefix(begin);
        auto const read = [&words] {
            unsigned number = 0;
            auto const end = std::from_chars(words.data(), words.data() + words.size(), number).ptr;
            words.remove_prefix(static_cast<std::size_t>(end - words.data()));
            return number;
        };
        auto const before = words.size();
        auto const first = read();
        auto last = first;
        bool const is_range = words.size() > 1 && (words[0] == '-' || words[0] == ':') &&
                              only_digits.find(words[1]) != std::string_view::npos;
        if (is_range) {
            words.remove_prefix(1);
            last = read();
        }
        if (first <= port && port <= last)
            return true;
        if (words.size() == before) // a number too large to be read
            return false;
    }
    return false;
}

/// An answer of a server that projects or registries are asked for: any but a server's own failure will do.
Finding judge_web_server(std::string_view subject, std::string_view url, result<int> const& answer,
                         Verdict silence, std::string_view remedy)
{
    if (!answer)
        return {silence, subject, concat(url, " is not reached: ", answer.error().message()), remedy};
    if (*answer >= server_error)
        return {Verdict::warning, subject, concat(url, " answers with HTTP status ", std::to_string(*answer)),
                "It is out of order at the moment: try again later."};
    return {Verdict::ok, subject, concat(url, " answers")};
}

} // namespace

Finding judge_port(std::string_view key, std::uint16_t port, PortHolder holder, std::string_view problem)
{
    auto const subject = concat("port ", std::to_string(port));
    switch (holder) {
    case PortHolder::nobody:
        return {Verdict::ok, subject, "it is free, the server does not run"};
    case PortHolder::this_server:
        return {Verdict::ok, subject, "the server runs there"};
    case PortHolder::other:
        return {Verdict::fault, subject, "another program, or a server of another user, listens there",
                concat("End it (ss -tlnp says what it is), or change ", key, ".")};
    case PortHolder::forbidden:
        return {Verdict::fault, subject, concat("this user may not open port ", std::to_string(port)),
                concat("Start the server as root or by systemd, or choose one from 1024 on with ", key, ".")};
    case PortHolder::elsewhere:
        return {
            Verdict::fault, subject,
            concat(problem, " is none of this machine's addresses now, and nothing can be opened there"),
            "`ip address` shows them; change \"listenAddress\" to one of them, or to \"::\", which is all."};
    case PortHolder::unusable:
        break;
    }
    return {Verdict::fault, subject, concat("nobody can listen there: ", problem),
            concat("Change ", key, ", or what keeps the server from it.")};
}

Finding judge_simulation_ports(std::uint16_t first, int wanted, int free)
{
    auto const subject = concat("ports from ", std::to_string(first));
    auto const found =
        concat(std::to_string(free), " of the ", std::to_string(wanted), " ports for simulators are free");
    if (free == wanted)
        return {Verdict::ok, subject, found};
    return {free == 0 ? Verdict::fault : Verdict::warning, subject, found,
            "So many simulations can run at once at most: change \"port\" or \"maxConnections\", or end the "
            "programs that listen there."};
}

Finding judge_certificate(result<> const& pair, result<CertificateFacts> const& facts, std::string_view host,
                          WallTime now)
{
    constexpr std::string_view subject = "certificate";
    if (facts && facts->is_weak)
        return {Verdict::fault, subject,
                concat("its key has only ", std::to_string(facts->key_bits), " bits, and browsers refuse it"),
                "Get one with a key of 2048 bits, or of an elliptic curve."};
    if (!pair)
        return {Verdict::fault, subject, pair.error().message(),
                "Correct \"sslCertificate\" and \"sslKey\"."};
    if (!facts)
        return {Verdict::fault, subject, facts.error().message(), "Correct \"sslCertificate\"."};
    if (facts->ends <= now)
        return {Verdict::fault, subject, concat("it has expired on ", utc_time(facts->ends)),
                "Renew it; the server reads it again by itself."};
    if (facts->begins > now)
        return {Verdict::fault, subject, concat("it is not valid before ", utc_time(facts->begins)),
                "Set the clock of this machine, or get another certificate."};
    if (!facts->fits)
        return {Verdict::fault, subject, concat("it is for ", facts->names, ", and not for ", host),
                "Get one for that name, or correct \"server\"."};
    if (!facts->chain_problem.empty())
        return {Verdict::warning, subject,
                concat("browsers will not believe it: ", facts->chain_problem, " (signed by ", facts->issuer,
                       ")"),
                "Get one from an authority that browsers know, and put its whole chain into "
                "\"sslCertificate\", after it."};
    auto const left = concat("for ", facts->names, ", valid for ", days(facts->ends - now));
    if (facts->ends - now < renewal_is_late)
        return {Verdict::warning, subject, left,
                "Renew it now, and see why that has not been done by itself (certbot renew --dry-run)."};
    return {Verdict::ok, subject, left};
}

Finding judge_forge(std::string_view url, result<int> const& answer)
{
    return judge_web_server("forge", url, answer, Verdict::fault,
                            "No project can be fetched from there: check the network, the name server and "
                            "https_proxy, or correct \"forges\".");
}

Finding judge_registry(std::string_view url, result<int> const& answer)
{
    return judge_web_server("registry", url, answer, Verdict::warning,
                            "It can't list this server: check the network, or correct \"notify\" ([] for "
                            "none).");
}

Finding judge_simulation_server(std::string_view address, result<LoadReport> const& report,
                                std::uint16_t proxy_port)
{
    auto const subject = concat("machine ", address);
    if (!report && proxy_port != 0)
        return {Verdict::fault, subject,
                concat("asked at port ", std::to_string(proxy_port), " of ",
                       address.substr(0, address.find('/')),
                       ", where a proxy has to lead to it: ", report.error().message()),
                "Start that proxy, as docs/proxies.md says, or write the machine with a colon, as host:port, "
                "if there "
                "is none."};
    if (!report)
        return {Verdict::fault, subject, report.error().message(),
                "No browser is sent there: start it, and let this machine reach it, or correct "
                "\"simulationServers\"."};
    auto const load = std::to_string(static_cast<int>(report->load));
    if (report->draining)
        return {Verdict::warning, subject, "it takes no new simulations",
                "It was asked to drain: run webots-simulation-server --resume there."};
    return {Verdict::ok, subject, concat("it answers, its load is ", load, "%")};
}

Finding judge_machine_name(std::string_view entry, std::size_t machines, std::string_view problem)
{
    auto const subject = concat("machine ", entry);
    if (machines == 0)
        return {Verdict::fault, subject, problem.empty() ? std::string("it has none") : std::string(problem),
                "No browser is sent there: check the name server, or correct \"simulationServers\"."};
    if (!problem.empty())
        return {Verdict::warning, subject, std::string(problem),
                "Compare what the name server says with docs/discovery.md."};
    return {Verdict::ok, subject,
            concat("it stands for ", std::to_string(machines), machines == 1 ? " machine" : " machines")};
}

Finding judge_mail_server(std::string_view address, result<> const& answer)
{
    if (answer)
        return {Verdict::ok, "mail", concat(address, " takes mails from us")};
    return {Verdict::fault, "mail", concat(address, ": ", answer.error().message()),
            "No mail reaches the administrator: correct \"mailServer\", \"mailServerPort\", "
            "\"mailSenderUser\" and \"mailSenderPassword\"."};
}

Finding judge_public_address(result<PublicReading> const& reading, std::string_view url)
{
    constexpr std::string_view subject = "public address";
    if (!reading)
        return {Verdict::fault, subject, concat(url, " is not reached: ", reading.error().message()),
                "Browsers are told this address: correct \"server\", \"ssl\" and \"portRewrite\", or the "
                "name, the proxy and the firewall that lead there."};
    if (reading->instance.empty())
        return {Verdict::fault, subject,
                concat(url, " does not lead to this server: HTTP status ", std::to_string(reading->status),
                       " from another program"),
                "Have the proxy in front pass this address on to the server (docs/access.md, \"Clients "
                "behind proxies\")."};
    if (reading->instance != reading->own_instance)
        return {Verdict::fault, subject, concat(url, " leads to another server than this one"),
                "Correct the target of the proxy in front, or \"server\" and \"port\"."};
    return {Verdict::ok, subject, concat(url, " leads here")};
}

FirewallReading parse_firewall(std::string_view rules, std::uint16_t port)
{
    FirewallReading reading;
    reading.can_be_seen = true;
    for (auto const line : split(rules, '\n')) {
        auto const has = [line](std::string_view words) {
            return line.find(words) != std::string_view::npos;
        };
        if ((has("hook input") && has("policy drop")) || has("-P INPUT DROP") || has("-P INPUT REJECT"))
            reading.drops_by_default = true;
        if (auto const at = line.find("dport"); at != std::string_view::npos)
            reading.names_port = reading.names_port || names(line.substr(at), port);
    }
    return reading;
}

Finding judge_firewall(FirewallReading const& reading, std::uint16_t port)
{
    constexpr std::string_view subject = "firewall";
    auto const number = std::to_string(port);
    if (!reading.can_be_seen)
        return {Verdict::ok, subject, "what is filtered can't be seen: only root may list the rules"};
    if (reading.drops_by_default && !reading.names_port)
        return {Verdict::warning, subject,
                concat("it drops what comes in unless a rule accepts it, and none names port ", number),
                concat("Where browsers are to reach this port, let them: nft add rule inet filter input tcp "
                       "dport ",
                       number, " accept.")};
    return {Verdict::ok, subject,
            reading.drops_by_default ? concat("a rule names port ", number)
                                     : "no rule of this machine drops everything by default"};
}

Finding judge_name(std::string_view name, result<std::size_t> const& addresses)
{
    if (!addresses)
        return {Verdict::fault, "name server", addresses.error().message(),
                "Check /etc/resolv.conf, and the name servers in it."};
    return {Verdict::ok, "name server",
            concat(name, " has ", std::to_string(*addresses), *addresses == 1 ? " address" : " addresses")};
}

} // namespace webots_cloud::core
