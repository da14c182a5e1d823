// Each rule looks at members that have been read, and refuses a key with a sentence that says what to
// write.
#include "config_rules.hpp"

#include "core/access/asked_name.hpp"
#include "core/access/host_name.hpp"
#include "core/access/ip_address.hpp"
#include "core/access/site_access.hpp"
#include "core/machine_labels.hpp"
#include "core/public_place.hpp"
#include "core/simulation/public_base.hpp"
#include "core/text.hpp"

#include <boost/url/authority_view.hpp>
#include <boost/url/parse.hpp>

#include <algorithm>
#include <optional>

namespace webots_cloud::core {
namespace {

namespace fs = std::filesystem;

/// `port`: the one with TLS.
void check_redirect(ConfigReader& reader, std::uint16_t port, NetworkConfig const& network)
{
    auto const redirect = network.redirect_port;
    if (redirect != 0 && !reader.has("sslCertificate"))
        reader.refuse("redirectPort", "0, since without \"sslCertificate\" nothing is reached by https here");
    if (redirect != 0 && redirect == port)
        reader.refuse("redirectPort", "another port than \"port\"");
    bool const redirects = redirect != 0 || reader.is_refused("redirectPort");
    if (!network.challenge_folder.empty() && !redirects)
        reader.refuse("challengeFolder",
                      "no such key without \"redirectPort\", where challenges are answered");
}

void check_origins(ConfigReader& reader, std::string_view key,
                   std::optional<std::vector<std::string>> const& origins)
{
    if (origins && !std::all_of(origins->begin(), origins->end(), core::is_origin_pattern))
        reader.refuse(key,
                      "a list of sites, as in \"https://example.org\", \"https://*.example.org\" or \"*\"");
}

/// Of an address the name is what was asked for; of one with letters beyond ASCII what browsers make of it.
std::string name_advice(std::string_view server)
{
    if (auto const ascii = ascii_host_name(server); ascii != server && is_authority(ascii))
        return concat(": write \"", ascii, "\", as browsers say it");
    auto name = server.substr(0, server.find_last_not_of('/') + 1);
    if (auto const scheme = name.find("://"); scheme != std::string_view::npos)
        name.remove_prefix(scheme + 3);
    auto const path = path_in(name);
    auto const host = name.substr(0, name.size() - path.size());
    auto const& advised = is_site_path(path) ? name : host;
    return name != server && is_authority(host) ? concat(": write \"", advised, "\"") : std::string();
}

/// What stands for many names would let in many: they are listed. `*` alone is as in `server`.
void check_host_names(ConfigReader& reader, std::vector<std::string> const& names)
{
    for (std::size_t i = 0; i < names.size(); ++i) {
        auto const& name = names[i];
        bool const is_pattern = name != asked_name && name.find('*') != std::string::npos;
        if (is_pattern || !is_authority(name))
            reader.refuse_entry("hostNames", i + 1, boost::json::value(name),
                                is_pattern
                                    ? "a whole name of this machine: patterns are for \"allowedOrigins\", "
                                      "so write each name"
                                    : "a name of this machine, as in \"lab7.example.org\"",
                                is_pattern ? std::string() : name_advice(name));
    }
}

/// Addresses and networks, as in `10.0.0.0/8`.
void check_networks(ConfigReader& reader, std::string_view key, std::vector<std::string> const& networks)
{
    constexpr std::string_view wanted =
        "an address or a network without bits set beyond it, as in \"127.0.0.1\", \"10.0.0.0/8\" or \"::1\"";
    for (std::size_t i = 0; i < networks.size(); ++i)
        if (!core::IpNetwork::parse(networks[i]))
            reader.refuse_entry(key, i + 1, boost::json::value(networks[i]), wanted);
}

/// What people write who mean this machine, all addresses, or a port too.
std::string listen_advice(std::string_view text)
{
    if (text == "localhost" || text == "*")
        return concat(": write ", text == "*" ? R"("::")" : R"("127.0.0.1")");
    auto const address = text.substr(0, text.rfind(':'));
    return core::IpAddress::parse(address) ? concat(": write \"", address, "\", and the port as \"port\"")
                                           : std::string();
}

} // namespace

void check_network(ConfigReader& reader, std::uint16_t port, NetworkConfig const& network)
{
    if (!reader.has("sslCertificate") && reader.has("sslKey"))
        reader.require("sslCertificate", "the file of the certificate that \"sslKey\" belongs to");
    if (!reader.has("sslKey") && reader.has("sslCertificate"))
        reader.require("sslKey", "the file of the key that \"sslCertificate\" belongs to");
    check_redirect(reader, port, network);
    if (!core::IpAddress::parse(network.listen_address))
        reader.refuse("listenAddress",
                      "a numeric address of this machine, as in \"127.0.0.1\", or \"::\" for all",
                      listen_advice(network.listen_address));
    check_networks(reader, "trustedProxies", network.trusted_proxies);
}

void warn_of_trust_in_everybody(NetworkConfig const& network, fs::path const& origin,
                                std::vector<std::string>& warnings)
{
    for (auto const& proxies : network.trusted_proxies)
        if (core::IpNetwork::parse(proxies)->is_everybody())
            warnings.push_back(
                concat(origin.string(), ": key \"trustedProxies\": \"", proxies,
                       "\" is everybody: no client is limited, and each can pass for another"));
}

void warn_of_open_site(PublicAddress const& address, NetworkConfig const& network, AccessConfig const& access,
                       fs::path const& origin, std::vector<std::string>& warnings)
{
    if (network.ssl_certificate.empty() || access.allowed_origins ||
        core::reach_of(address.host) != core::Reach::everybody)
        return;
    warnings.push_back(concat(origin.string(),
                              ": pages of every site may use this server. For those of its own site and of "
                              "webots.cloud alone add this line: \"allowedOrigins\": [\"https://",
                              address.host, "\", \"https://webots.cloud\"],"));
}

void check_labels(ConfigReader& reader, std::vector<std::string> const& labels)
{
    constexpr auto most = core::max_labels - 1; // with the one that a machine adds itself
    if (labels.size() > most || !std::ranges::all_of(labels, core::is_label))
        reader.refuse("labels",
                      "at most 31 labels of 1 to 40 letters, digits, \".\", \"_\", \"-\" and \"+\"");
}

bool is_authority(std::string_view text, Port port)
{
    auto const authority = boost::urls::parse_authority(text);
    return authority && !authority->encoded_host().empty() && !authority->has_userinfo() &&
           (authority->has_port() ? core::parse_port(authority->port()) != 0 : port == Port::optional);
}

void check_access(ConfigReader& reader, AccessConfig const& access)
{
    check_host_names(reader, access.host_names);
    check_origins(reader, "allowedOrigins", access.allowed_origins);
    check_origins(reader, "frameAncestors", access.frame_ancestors);
    check_networks(reader, "monitorAddresses", access.monitor_addresses);
}

void read_server_name(ConfigReader& reader, std::string_view key, PublicAddress& address)
{
    if (!reader.has(key) || reader.is_refused(key) || address.host.empty())
        return;
    std::string const path(path_in(address.host));
    auto const host = address.host.substr(0, address.host.size() - path.size());
    if (!is_authority(host))
        return reader.refuse(key, "the name of a host, as in \"sim.example.org\"", name_advice(address.host));
    if (!path.empty() && !is_site_path(path))
        return reader.refuse(key,
                             "the name of a host, or one with a path of at most 100 letters, digits, \"-\", "
                             "\"_\", \".\" and \"~\", as in \"sim.example.org/webots\"",
                             name_advice(address.host));
    address.host = host;
    if (!path.empty())
        address.path = path;
}

void warn_of_two_ports(ConfigReader& reader, std::string_view key, PublicAddress const& address)
{
    auto const authority = boost::urls::parse_authority(address.host);
    if (!reader.has(key) || reader.is_refused(key) || address.port_rewrite || !address.path.empty() ||
        !authority || !authority->has_port())
        return;
    std::string const name(std::string_view(authority->encoded_host()));
    reader.warn(key, concat("\"", address.host,
                            "\" has a port, and as \"portRewrite\" is false another one follows it: "
                            "browsers are sent to ",
                            public_base(address), ", which is no address. Write \"", name, "\""));
}

void make_printable(std::vector<std::string>& warnings)
{
    constexpr std::size_t max_warning_length = 4096;
    for (auto& warning : warnings)
        warning = core::printable(warning, max_warning_length);
}

} // namespace webots_cloud::core
