// What the readings of the network mean for an operator: ports, certificates, other servers, the way of
// browsers to us.
#pragma once

#include "certificate_facts.hpp"
#include "finding.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/load_report.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Who has a port of this machine.
enum class PortHolder : std::uint8_t
{
    nobody,
    this_server, ///< A server with this configuration runs already, as our user.
    other,
    forbidden, ///< Our user may not listen there.
    elsewhere, ///< The address is none of this machine's.
    unusable,  ///< It can't be listened on, for another reason.
};

/// `key` names the port in the configuration, with quotes; `problem` is why it is unusable, or the address
/// that is elsewhere.
Finding judge_port(std::string_view key, std::uint16_t port, PortHolder holder, std::string_view problem);

/// `free` of the `wanted` ports of simulations, from `first` on, can be listened on.
Finding judge_simulation_ports(std::uint16_t first, int wanted, int free);

/// `pair`: whether certificate and key can be used together (`check_certificate`). `host`: what it has to be
/// for; empty: any name will do. `facts` count where the pair is good.
Finding judge_certificate(result<> const& pair, result<CertificateFacts> const& facts, std::string_view host,
                          WallTime now);

/// Another web server that is asked whether it is there: the status of its answer.
Finding judge_forge(std::string_view url, result<int> const& answer);
Finding judge_registry(std::string_view url, result<int> const& answer);

/// What a simulation server answers to a session server. `proxy_port`: where a proxy was asked for it, as for
/// `host/2000`; 0: it was asked itself.
Finding judge_simulation_server(std::string_view address, result<LoadReport> const& report,
                                std::uint16_t proxy_port = 0);

/// For how many machines a name stands, and what was wrong with the answer.
Finding judge_machine_name(std::string_view entry, std::size_t machines, std::string_view problem);

Finding judge_mail_server(std::string_view address, result<> const& answer);

/// What the public address leads to.
struct PublicReading
{
    PublicReading() = default;

    std::string url;          ///< That was asked.
    int status = 0;           ///< Of the answer.
    std::string instance;     ///< That the answer names; empty: none.
    std::string own_instance; ///< That it has to be.
};

Finding judge_public_address(result<PublicReading> const& reading, std::string_view url);

/// What of this machine's packet filters can be seen.
struct FirewallReading
{
    FirewallReading() = default;

    bool can_be_seen = false;
    /// A chain of packets that come in drops what nothing else accepts.
    bool drops_by_default = false;
    bool names_port = false; ///< Some rule names our port.
};

/// What `nft list ruleset` or `iptables -S` has printed, for a port.
FirewallReading parse_firewall(std::string_view rules, std::uint16_t port);

Finding judge_firewall(FirewallReading const& reading, std::uint16_t port);

/// A host name that has to be found: how many addresses it has.
Finding judge_name(std::string_view name, result<std::size_t> const& addresses);

} // namespace webots_cloud::core
