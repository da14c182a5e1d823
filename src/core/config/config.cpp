#include <webots_cloud/config.hpp>

#include "config_reader.hpp"
#include "core/access/forwarding.hpp"
#include "core/access/ip_address.hpp"
#include "core/access/site_access.hpp"
#include "core/docker/docker_project.hpp"
#include "core/notices/mail_message.hpp"
#include "core/projects/repository_policy.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/text.hpp"

#include <boost/url/authority_view.hpp>
#include <boost/url/parse.hpp>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <tuple>

namespace webots_cloud {
namespace {

using core::concat;
using core::ConfigReader;

namespace fs = std::filesystem;

constexpr double max_seconds = 10'000'000;
constexpr int max_port = 65535;

void read_seconds(ConfigReader& reader, std::string_view key, Duration& value, double min)
{
    double seconds = std::chrono::duration<double>(value).count();
    reader.read_number(key, seconds, min, max_seconds);
    value = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

void read_port(ConfigReader& reader, std::uint16_t& value, int highest)
{
    int port = value;
    reader.read_integer("port", port, 1, highest);
    value = static_cast<std::uint16_t>(port);
}

void read_networks(ConfigReader& reader, std::string_view key, std::vector<std::string>& networks)
{
    constexpr std::string_view wanted =
        "an address or a network without bits set beyond it, as in \"127.0.0.1\", \"10.0.0.0/8\" or \"::1\"";
    reader.read(key, networks);
    for (std::size_t i = 0; i < networks.size(); ++i)
        if (!core::IpNetwork::parse(networks[i]))
            reader.refuse_entry(key, i + 1, boost::json::value(networks[i]), wanted);
}

void read_ping_timeout(ConfigReader& reader, Duration& timeout)
{
    constexpr Duration min = std::chrono::seconds(2); // connections are looked at once a second
    read_seconds(reader, "pingTimeout", timeout, 0);
    if (timeout > Duration::zero() && timeout < min)
        reader.refuse("pingTimeout", "0, or a number from 2 to 10000000");
}

/// `port`: the one with TLS.
void read_redirect(ConfigReader& reader, std::uint16_t port, NetworkConfig& network)
{
    int redirect = 0;
    reader.read_integer("redirectPort", redirect, 0, max_port);
    network.redirect_port = static_cast<std::uint16_t>(redirect);
    reader.read("challengeFolder", network.challenge_folder);
    if (redirect != 0 && network.ssl_certificate.empty())
        reader.refuse("redirectPort", "0, since without \"sslCertificate\" nothing is reached by https here");
    if (redirect != 0 && redirect == port)
        reader.refuse("redirectPort", "another port than \"port\"");
    if (!network.challenge_folder.empty() && redirect == 0)
        reader.refuse("challengeFolder",
                      "no such key without \"redirectPort\", where challenges are answered");
}

/// `port`: that of this configuration.
void read_network(ConfigReader& reader, std::uint16_t port, NetworkConfig& network)
{
    reader.read("sslCertificate", network.ssl_certificate);
    reader.read("sslKey", network.ssl_key);
    if (network.ssl_certificate.empty() && reader.has("sslKey"))
        reader.require("sslCertificate", "the file of the certificate that \"sslKey\" belongs to");
    if (network.ssl_key.empty() && reader.has("sslCertificate"))
        reader.require("sslKey", "the file of the key that \"sslCertificate\" belongs to");
    read_redirect(reader, port, network);
    reader.read("listenAddress", network.listen_address);
    if (!core::IpAddress::parse(network.listen_address))
        reader.refuse("listenAddress",
                      "a numeric address of this machine, as in \"127.0.0.1\", or \"::\" for all");
    reader.read_integer("connectionsPerAddress", network.connections_per_address, 1, 1'000'000);
    read_networks(reader, "trustedProxies", network.trusted_proxies);
    read_ping_timeout(reader, network.ping_timeout);
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

/// A site that speaks TLS to the world has chosen who may use it, or is told how.
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

bool is_port(std::string_view text)
{
    std::uint16_t port = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
    return error == std::errc() && end == text.data() + text.size() && port != 0;
}

enum class Port
{
    optional,
    required
};

/// What may stand between `https://` and the first slash: a proxy may have a port of its own.
bool is_authority(std::string_view text, Port port = Port::optional)
{
    auto const authority = boost::urls::parse_authority(text);
    return authority && !authority->encoded_host().empty() && !authority->has_userinfo() &&
           (authority->has_port() ? is_port(authority->port()) : port == Port::optional);
}

/// Lists of origins, which are left alone when they are absent.
void read_origins(ConfigReader& reader, std::string_view key,
                  std::optional<std::vector<std::string>>& origins)
{
    if (!reader.has(key))
        return reader.ignore({key});
    origins.emplace();
    reader.read(key, *origins);
    if (!std::all_of(origins->begin(), origins->end(), core::is_origin_pattern))
        reader.refuse(key,
                      "a list of sites, as in \"https://example.org\", \"https://*.example.org\" or \"*\"");
}

void read_access(ConfigReader& reader, AccessConfig& access)
{
    reader.read("hostNames", access.host_names);
    if (!std::all_of(access.host_names.begin(), access.host_names.end(),
                     [](std::string const& name) { return is_authority(name); }))
        reader.refuse("hostNames", "a list of names of this machine, as in \"lab7.example.org\"");
    read_origins(reader, "allowedOrigins", access.allowed_origins);
    read_origins(reader, "frameAncestors", access.frame_ancestors);
    reader.read_secret("monitorPassword", access.monitor_password);
    read_networks(reader, "monitorAddresses", access.monitor_addresses);
    reader.read("operatorTokenFile", access.operator_token_file);
    reader.read("sessionSecret", access.session_secret);
    reader.read("operatorSocket", access.operator_socket);
}

/// The keys of both servers.
template<class Config>
void read_log(ConfigReader& reader, Config& config)
{
    reader.read("logDir", config.log_dir);
    reader.read("debug", config.debug);
    std::string format = "text";
    reader.read_choice("logFormat", format, {"text", "json"});
    config.json_log = format == "json";
}

bool is_server_address(std::string_view text)
{
    auto const slash = text.find('/');
    return slash == std::string_view::npos
               ? is_authority(text, Port::required)
               : is_authority(text.substr(0, slash)) && is_port(text.substr(slash + 1));
}

/// Empty: as ever, nobody looks.
void read_server_name(ConfigReader& reader, std::string_view key, std::string& server)
{
    reader.read(key, server);
    if (reader.has(key) && !server.empty() && !is_authority(server))
        reader.refuse(key, "the name of a host, as in \"sim.example.org\"");
}

/// Where the session server itself reaches a machine, and which of its ports.
void read_internal_address(ConfigReader& inner, ServerSpec& server)
{
    inner.read("internal", server.internal_address);
    if (inner.has("internal") && !core::parse_numeric_address(server.internal_address))
        inner.refuse("internal", "a numeric address and a port, as in \"10.0.0.2:2000\"");
    std::string ports;
    inner.read("ports", ports);
    auto const range = core::parse_port_range(ports);
    if (inner.has("ports") && !range)
        inner.refuse("ports", "a port or a range of ports, as in \"2001-2100\"");
    if (range)
        std::tie(server.first_port, server.last_port) = *range;
}

/// An entry of `simulationServers`: an address, or an object with an address and how to treat it.
void read_simulation_server(ConfigReader& reader, std::size_t number, boost::json::value const& entry,
                            ServerSpec& server)
{
    constexpr std::string_view key = "simulationServers";
    constexpr std::string_view address = "\"host:port\" or \"host/port\", with a port from 1 to 65535";
    if (auto const* text = entry.if_string()) {
        server.address = *text;
        if (!is_server_address(server.address))
            reader.refuse_entry(key, number, entry, address);
    } else if (auto const* object = entry.if_object()) {
        auto inner = reader.entry(key, number, *object);
        inner.read("address", server.address);
        inner.read_number("weight", server.weight, 0.001, 1'000'000);
        inner.read("drain", server.drain);
        read_internal_address(inner, server);
        if (!inner.has("address"))
            inner.require("address", address);
        else if (!is_server_address(server.address))
            inner.refuse("address", address);
        reader.take_over(inner);
    } else {
        reader.refuse_entry(key, number, entry,
                            concat(address, ", or {\"address\": ..., \"weight\": 2, \"drain\": true}"));
    }
}

void read_simulation_servers(ConfigReader& reader, std::vector<ServerSpec>& servers)
{
    constexpr std::string_view wanted = "a list of \"host:port\" or \"host/port\", or of objects "
                                        "{\"address\": ..., \"weight\": 2, \"drain\": true}";
    auto const* found = reader.find("simulationServers");
    if (!found)
        return reader.require("simulationServers", wanted);
    if (!found->is_array())
        return reader.refuse("simulationServers", wanted);
    for (auto const& entry : found->get_array()) {
        auto& server = servers.emplace_back();
        read_simulation_server(reader, servers.size(), entry, server);
    }
}

/// What the gateway passes on is known by its port alone, so no two machines may have the same.
void refuse_ambiguous_ports(ConfigReader& reader, std::vector<ServerSpec> const& servers)
{
    std::map<std::uint16_t, std::size_t> owners;
    for (std::size_t i = 0; i < servers.size(); ++i) {
        auto const& server = servers[i];
        std::vector<std::uint16_t> ports{core::public_port(server.address)};
        for (int port = server.first_port; port != 0 && port <= server.last_port; ++port)
            ports.push_back(static_cast<std::uint16_t>(port));
        for (auto const port : ports)
            if (auto const [owner, is_new] = owners.emplace(port, i + 1); port != 0 && !is_new)
                return reader.refuse_entry("simulationServers", i + 1, boost::json::value(server.address),
                                           concat("another port than ", std::to_string(port),
                                                  ", which entry ", std::to_string(owner->second),
                                                  " has as well: the gateway knows machines by their ports"));
    }
}

void read_gateway(ConfigReader& reader, SessionConfig& config)
{
    auto& servers = config.simulation_servers;
    config.gateway = std::any_of(servers.begin(), servers.end(), [](ServerSpec const& server) {
        return !server.internal_address.empty() && core::public_port(server.address) != 0;
    });
    reader.read("gateway", config.gateway);
    if (!config.gateway)
        return;
    for (auto& server : servers)
        if (auto const port = core::public_port(server.address); port != 0 && server.internal_address.empty())
            server.internal_address = concat("127.0.0.1:", std::to_string(port));
    refuse_ambiguous_ports(reader, servers);
}

/// Simulation servers announce simulations below their own `port`.
void warn_of_other_ports(SessionConfig const& config, fs::path const& origin,
                         std::vector<std::string>& warnings)
{
    if (!config.gateway)
        return;
    for (auto const& server : config.simulation_servers) {
        auto const port = core::public_port(server.address);
        auto const machine = core::parse_numeric_address(server.internal_address);
        if (machine && port != 0 && machine->port != port)
            warnings.push_back(
                concat(origin.string(), ": key \"simulationServers\": ", server.address, " is at ",
                       server.internal_address,
                       ", but a simulation server sends browsers to its own \"port\": set that to ",
                       std::to_string(port), " there, in \"internal\" too"));
    }
}

void read_session_budget(ConfigReader& reader, SessionConfig& config)
{
    constexpr int max = 100'000;
    constexpr double slowest = 0.01;
    reader.read_integer("sessionBurst", config.session_burst, 0, max);
    reader.read_number("sessionRate", config.session_rate, 0, max);
    if (config.session_rate > 0 && config.session_rate < slowest)
        reader.refuse("sessionRate", "0, or a number from 0.01 to 100000");
}

/// Empty counts as absent: operators switch mails off like that.
void read_mail(ConfigReader& reader, SessionConfig& config)
{
    reader.read_text("administrator", config.administrator);
    reader.read_text("mailServer", config.mail_server);
    int port = config.mail_server_port;
    reader.read_integer("mailServerPort", port, 0, 65535);
    config.mail_server_port = static_cast<std::uint16_t>(port);
    reader.read_text("mailSender", config.mail_sender);
    reader.read("mailSenderUser", config.mail_sender_user);
    reader.read_secret("mailSenderPassword", config.mail_sender_password);
    if (config.mail_sender_user.empty())
        config.mail_sender_user = config.mail_sender;
    if (!config.administrator.empty() && !core::is_mail_address(config.administrator))
        reader.refuse("administrator", "an e-mail address");
    if (!config.mail_sender.empty() && !core::is_mail_address(config.mail_sender))
        reader.refuse("mailSender", "an e-mail address");
    if (!config.mail_server.empty() && !core::is_mail_host(config.mail_server))
        reader.refuse("mailServer", "the name of a host");
}

void drop_administrator_without_mail(SessionConfig& config, fs::path const& origin,
                                     std::vector<std::string>& warnings)
{
    auto const missing = config.mail_server.empty()   ? "mailServer"
                         : config.mail_sender.empty() ? "mailSender"
                                                      : "";
    if (config.administrator.empty() || !*missing)
        return;
    warnings.push_back(
        concat(origin.string(), ": key \"administrator\" is ignored: no e-mails without \"", missing, "\""));
    config.administrator.clear();
}

std::string without_final_slash(std::string url)
{
    while (url.ends_with('/'))
        url.pop_back();
    return url;
}

bool is_web_address(std::string_view url)
{
    for (std::string_view const scheme : {"https://", "http://"})
        if (url.starts_with(scheme) && core::is_printable(url))
            return is_authority(url.substr(scheme.size(), url.find('/', scheme.size()) - scheme.size()));
    return false;
}

void read_forge(ConfigReader& reader, std::size_t number, boost::json::value const& entry,
                fs::path const& folder, ForgeConfig& forge)
{
    if (auto const* url = entry.if_string()) {
        forge.url = without_final_slash(std::string(*url));
        bool const is_web = forge.url.starts_with("https://") || forge.url.starts_with("http://");
        if (!is_web || !core::is_printable(forge.url))
            reader.refuse_entry("forges", number, entry, "a URL that starts with https:// or http://");
    } else if (auto const* object = entry.if_object()) {
        auto inner = reader.entry("forges", number, *object);
        inner.read("url", forge.url);
        inner.read("directory", forge.directory);
        if (!inner.has("url"))
            inner.require("url", "the beginning of the addresses of its worlds, as in \"local:\"");
        if (!inner.has("directory"))
            inner.require("directory", "a folder");
        forge.url = without_final_slash(std::move(forge.url));
        forge.directory = (folder / forge.directory).lexically_normal();
        reader.take_over(inner);
    } else {
        reader.refuse_entry("forges", number, entry, "a base URL, or {\"url\": ..., \"directory\": ...}");
    }
}

void read_forges(ConfigReader& reader, fs::path const& folder, std::vector<ForgeConfig>& forges)
{
    auto const* found = reader.find("forges");
    if (!found)
        return;
    auto const* list = found->if_array();
    if (!list)
        return reader.refuse("forges",
                             "a list of base URLs, or of objects {\"url\": ..., \"directory\": ...}");
    forges.clear();
    for (auto const& entry : *list) {
        auto& forge = forges.emplace_back();
        read_forge(reader, forges.size(), entry, folder, forge);
    }
}

void read_notify(ConfigReader& reader, std::vector<std::string>& registries)
{
    auto const* found = reader.find("notify");
    if (found && found->is_string())
        registries = {std::string(found->get_string())};
    else
        reader.read("notify", registries);
    if (found && !std::all_of(registries.begin(), registries.end(), is_web_address))
        reader.refuse("notify", "addresses that start with https:// or http://, or [] for none");
}

/// Simulations have the ports after the server's, and in containers editors those 500 above them.
void limit_connections(SimulationConfig& config, fs::path const& origin, std::vector<std::string>& warnings)
{
    int const room = (config.docker ? max_port - core::editor_distance : max_port) - config.address.port;
    if (config.max_connections <= room)
        return;
    warnings.push_back(concat(origin.string(), ": key \"maxConnections\": only ", std::to_string(room),
                              " simulations at once instead of ", std::to_string(config.max_connections),
                              ", since there are no more ports above \"port\" (",
                              std::to_string(config.address.port), ")"));
    config.max_connections = room;
}

/// Unless the operator has said it: a class behind one address has room, and leaves some to others.
void share_connections(ConfigReader const& reader, SimulationConfig& config)
{
    if (!reader.has("simulationsPerAddress"))
        config.simulations_per_address = (3 * config.max_connections + 3) / 4;
}

/// Repositories that are on none of the forges have no effect.
void warn_of_foreign(std::string_view key, std::vector<std::string> const& repositories,
                     SimulationConfig const& config, fs::path const& origin,
                     std::vector<std::string>& warnings)
{
    for (auto const& repository : repositories) {
        auto const is_there = [&repository](ForgeConfig const& forge) {
            return core::is_on_forge(repository, forge.url);
        };
        if (std::none_of(config.forges.begin(), config.forges.end(), is_there))
            warnings.push_back(
                concat(origin.string(), ": key \"", key, "\": \"", core::printable(repository, 200),
                       "\" has no effect: it is on none of the \"forges\", for instance ",
                       config.forges.empty() ? "https://github.com" : config.forges.front().url, "/<owner>"));
    }
}

void warn_of_plain_simulators(SimulationConfig const& config, fs::path const& origin,
                              std::vector<std::string>& warnings)
{
    if (config.gateway || config.network.ssl_certificate.empty() || !config.address.ssl ||
        config.address.port_rewrite)
        return;
    warnings.push_back(concat(
        origin.string(), ": browsers are sent to wss://", config.address.host,
        ":<port of the simulation>, but simulators speak no TLS, whatever \"sslCertificate\" says: no "
        "simulation can be shown. Set \"gateway\" to true, or let a proxy end TLS, as in config/nginx, and "
        "set \"portRewrite\" to true"));
}

/// Until 2021 there was no such key, and plain http unless the server had a certificate.
void warn_of_assumed_tls(ConfigReader const& reader, SessionConfig const& config, fs::path const& origin,
                         std::vector<std::string>& warnings)
{
    auto const has_port = [](ServerSpec const& server) {
        return server.address.find('/') == std::string::npos;
    };
    auto const& servers = config.simulation_servers;
    auto const direct = std::find_if(servers.begin(), servers.end(), has_port);
    if (reader.has("ssl") || direct == servers.end())
        return;
    warnings.push_back(
        concat(origin.string(),
               ": key \"ssl\" is missing and counts as true: simulation servers are asked by https (https://",
               core::printable(direct->address, 200),
               "/load) and browsers sent to wss://. Configurations of 2018 to 2021 "
               "have no such key, and their machines speak plain http: then set it to false; else to true"));
}

void warn_of_assumed_tls(ConfigReader const& reader, SimulationConfig const& config, fs::path const& origin,
                         std::vector<std::string>& warnings)
{
    bool const is_told = !config.network.ssl_certificate.empty(); // by warn_of_plain_simulators
    if (reader.has("ssl") || config.address.port_rewrite || is_told)
        return;
    if (config.gateway) {
        warnings.push_back(concat(
            origin.string(), ": key \"ssl\" is missing and counts as true: browsers are sent to wss://",
            config.address.host, ":", std::to_string(config.address.port),
            ", where this server speaks plain http. Configurations of 2018 to 2021 have no such "
            "key: set it to false, or to true if a proxy ends TLS on that port"));
        return;
    }
    warnings.push_back(concat(origin.string(),
                              ": key \"ssl\" is missing and counts as true: browsers are sent to wss://",
                              config.address.host,
                              ":<port of the simulation>, where simulators speak plain http. Configurations "
                              "of 2018 to 2021 have no such "
                              "key: set it to false, or to true if a proxy ends TLS on those ports"));
}

/// Both end up in one option of Webots, which takes them apart again.
void read_multimedia(ConfigReader& reader, SimulationConfig& config)
{
    reader.read("multimediaServer", config.multimedia_server);
    reader.read("multimediaStream", config.multimedia_stream);
    constexpr auto* separators = " \t\";";
    if (config.multimedia_server.find_first_of(separators) != std::string::npos)
        reader.refuse("multimediaServer", "an address without spaces, quotes and semicolons");
    if (config.multimedia_stream.find_first_of(separators) != std::string::npos)
        reader.refuse("multimediaStream", "an address without spaces, quotes and semicolons");
}

void read_simulator_environment(ConfigReader& reader, SimulationConfig& config)
{
    constexpr std::string_view key = "simulatorEnvironment";
    constexpr std::size_t longest = 128 * 1024; // of all entries: no program is started with much more
    auto& entries = config.simulator_environment;
    reader.read(key, entries);
    std::size_t size = 0;
    for (std::size_t i = 0; i < entries.size(); ++i) {
        std::string_view const entry = entries[i];
        auto wanted = core::wanted_instead(entry);
        auto const name = core::name_of_entry(entry);
        if (config.docker && core::is_set_for_compose(name))
            wanted = "no variable that the server sets for compose itself (see docs/docker.md)";
        if (!wanted.empty()) // and no value, which may be long, or better not on the terminal
            reader.refuse_entry(
                key, i + 1,
                boost::json::value(name.size() < entry.size() ? concat(name, "=...") : std::string(name)),
                wanted);
        size += entry.size();
    }
    if (size > longest)
        reader.refuse(key, "at most 131072 characters in all");
}

/// They quote the configuration and name its file, and are printed on terminals.
void make_printable(std::vector<std::string>& warnings)
{
    constexpr std::size_t max_warning_length = 4096;
    for (auto& warning : warnings)
        warning = core::printable(warning, max_warning_length);
}

void read_fetch_budget(ConfigReader& reader, SimulationConfig& config)
{
    constexpr double min_megabytes = 192; // less, and not even a small project could be fetched
    double megabytes = static_cast<double>(config.fetch_memory >> 20);
    reader.read_number("fetchMemory", megabytes, min_megabytes, 1'000'000);
    config.fetch_memory = static_cast<std::uint64_t>(megabytes * (1 << 20));
    double gigabytes = static_cast<double>(config.fetch_disk >> 30);
    reader.read_number("fetchDisk", gigabytes, 0.1, 100'000);
    config.fetch_disk = static_cast<std::uint64_t>(gigabytes * (1 << 30));
}

/// Containers are one of the sandboxes; `docker`, the older key, chooses the same.
void read_sandbox(ConfigReader& reader, SimulationConfig& config)
{
    reader.read("docker", config.docker);
    reader.read_choice("sandbox", config.sandbox, {"auto", "none", "bubblewrap", "firejail", "docker"});
    bool const wants_docker = config.sandbox == "docker";
    if (wants_docker && reader.has("docker") && !config.docker)
        reader.refuse("sandbox", "another one than \"docker\", since \"docker\" is false");
    if (config.docker && !wants_docker && config.sandbox != "auto")
        reader.refuse("sandbox", "\"docker\" or \"auto\", since \"docker\" is true");
    config.docker = config.docker || wants_docker;
}

std::uint64_t megabytes_of(double megabytes)
{
    return static_cast<std::uint64_t>(megabytes * (1 << 20));
}

/// Limits, of which 0 is none, and less than `min` would let no simulation start.
void read_limits(ConfigReader& reader, LimitsConfig& limits)
{
    constexpr double max = 1'000'000'000;
    auto const read = [&reader](std::string_view key, double value, double min, std::string_view least) {
        reader.read_number(key, value, 0, max);
        if (value > 0 && value < min)
            reader.refuse(key, concat("0 for no limit, or at least ", least));
        return value;
    };
    auto const memory = read("simulationMemory", 0, 64, "64");
    if (reader.has("simulationMemory"))
        limits.memory = megabytes_of(memory);
    limits.processors = read("simulationCpus", limits.processors, 0.01, "0.01");
    auto const processes = read("simulationProcesses", 0, 10, "10");
    if (reader.has("simulationProcesses"))
        limits.processes = static_cast<std::uint64_t>(processes);
    limits.files =
        static_cast<std::uint64_t>(read("simulationFiles", static_cast<double>(limits.files), 64, "64"));
    limits.disk = megabytes_of(read("simulationDisk", static_cast<double>(limits.disk >> 20), 0.1, "0.1"));
}

void read_docker(ConfigReader& reader, fs::path const& folder, DockerConfig& docker)
{
    reader.read("dockerDir", docker.directory);
    docker.directory = (folder / docker.directory).lexically_normal();
    reader.read("dockerImages", docker.images);
    reader.read("projectDockerfiles", docker.project_dockerfiles);
    if (!reader.has("persistantDockerImages"))
        return reader.ignore({"persistantDockerImages"});
    docker.persistent_images.emplace();
    reader.read("persistantDockerImages", *docker.persistent_images);
}

} // namespace

result<Configured<SessionConfig>> parse_session_config(std::string_view text,
                                                       std::filesystem::path const& origin)
{
    auto reader = ConfigReader::parse(text, origin);
    if (!reader)
        return reader.error();
    Configured<SessionConfig> configured;
    auto& config = configured.config;
    read_port(*reader, config.address.port, 65535);
    if (!reader->has("port"))
        reader->require("port", "an integer from 1 to 65535");
    read_simulation_servers(*reader, config.simulation_servers);
    read_gateway(*reader, config);
    read_server_name(*reader, "server", config.address.host);
    reader->read("ssl", config.address.ssl);
    reader->read("portRewrite", config.address.port_rewrite);
    read_network(*reader, config.address.port, config.network);
    read_access(*reader, config.access);
    read_log(*reader, config);
    read_seconds(*reader, "loadRefresh", config.load_refresh, 0.1);
    read_seconds(*reader, "loadTimeout", config.load_timeout, 0.1);
    reader->read_number("loadThreshold", config.load_threshold, 1, 1000);
    reader->read_choice("scheduling", config.scheduling,
                        {"least_committed", "least_reported", "random", "power_of_two"});
    read_seconds(*reader, "placementTimeout", config.placement_timeout, 0);
    read_session_budget(*reader, config);
    reader->read("decisionsForAll", config.decisions_for_all);
    reader->read("viewerUrl", config.viewer_url);
    read_mail(*reader, config);
    if (auto const failure = reader->failure())
        return *failure;
    configured.warnings = reader->unknown_keys();
    drop_administrator_without_mail(config, origin, configured.warnings);
    warn_of_assumed_tls(*reader, config, origin, configured.warnings);
    warn_of_other_ports(config, origin, configured.warnings);
    warn_of_trust_in_everybody(config.network, origin, configured.warnings);
    warn_of_open_site(config.address, config.network, config.access, origin, configured.warnings);
    make_printable(configured.warnings);
    return configured;
}

result<Configured<SimulationConfig>> parse_simulation_config(std::string_view text,
                                                             std::filesystem::path const& origin)
{
    auto reader = ConfigReader::parse(text, origin);
    if (!reader)
        return reader.error();
    Configured<SimulationConfig> configured;
    auto& config = configured.config;
    read_server_name(*reader, "fullyQualifiedDomainName", config.address.host);
    read_server_name(*reader, "server", config.address.host);
    reader->read("ssl", config.address.ssl);
    read_sandbox(*reader, config);
    // Simulations have the ports after it, and their editors those 500 above.
    read_port(*reader, config.address.port, max_port - 1 - (config.docker ? core::editor_distance : 0));
    reader->read("portRewrite", config.address.port_rewrite);
    read_network(*reader, config.address.port, config.network);
    read_access(*reader, config.access);
    read_docker(*reader, origin.parent_path(), config.containers);
    reader->read("allowedRepositories", config.allowed_repositories);
    reader->read("blockedRepositories", config.blocked_repositories);
    reader->read_number("shareIdleTime", config.share_idle_time, 0, 100);
    read_forges(*reader, origin.parent_path(), config.forges);
    read_notify(*reader, config.notify);
    double gigabytes = static_cast<double>(config.cache_bytes >> 30);
    reader->read_number("cacheSize", gigabytes, 0.1, 100'000);
    config.cache_bytes = static_cast<std::uint64_t>(gigabytes * (1 << 30));
    reader->read("stateDir", config.state_dir);
    read_fetch_budget(*reader, config);
    reader->read("webotsHome", config.webots_home);
    reader->read("display", config.display);
    reader->read("simulationUser", config.simulation_user);
    reader->read("confineServer", config.confine_server);
    reader->read_choice("network", config.network_reach, {"internet", "none", "host"});
    read_limits(*reader, config.limits);
    reader->read("gateway", config.gateway);
    double traffic = 0;
    reader->read_number("trafficLimit", traffic, 0, 1e12);
    config.traffic_limit = static_cast<std::uint64_t>(traffic);
    read_simulator_environment(*reader, config);
    reader->read_integer("maxConnections", config.max_connections, 1, 10'000);
    if (config.docker && config.max_connections >= core::editor_distance)
        reader->refuse(
            "maxConnections",
            "at most 499 with \"docker\", since the port of an editor is 500 above that of its simulation");
    reader->read_integer("simulationsPerAddress", config.simulations_per_address, 0, 10'000);
    read_seconds(*reader, "timeout", config.timeout, 0);
    read_seconds(*reader, "startTimeout", config.start_timeout, 1);
    read_seconds(*reader, "reconnectGrace", config.reconnect_grace, 0);
    read_log(*reader, config);
    reader->read_text("title", config.title);
    reader->read_text("description", config.description);
    std::string formula = "strict";
    reader->read_choice("loadFormula", formula, {"strict", "reference"});
    config.strict_load = formula == "strict";
    reader->read("monitorLogEnabled", config.monitor_log);
    double days = 7;
    reader->read_number("simulationLogDays", days, 0, 3650);
    config.simulation_log_keep =
        std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::ratio<86400>>(days));
    reader->read("projectsDir", config.projects_dir);
    reader->read("keyDir", config.key_dir);
    read_multimedia(*reader, config);
    reader->ignore({"publicPort"});
    if (auto const failure = reader->failure())
        return *failure;
    configured.warnings = reader->unknown_keys();
    if (!reader->find("server") && !reader->find("fullyQualifiedDomainName"))
        configured.warnings.push_back(
            concat(origin.string(), ": key \"server\" is missing: browsers are sent to \"localhost\", which "
                                    "is right only on this machine"));
    limit_connections(config, origin, configured.warnings);
    share_connections(*reader, config);
    warn_of_plain_simulators(config, origin, configured.warnings);
    if (!config.gateway && config.traffic_limit > 0)
        configured.warnings.push_back(
            concat(origin.string(), ": key \"trafficLimit\" has no effect, since \"gateway\" is false"));
    warn_of_assumed_tls(*reader, config, origin, configured.warnings);
    warn_of_trust_in_everybody(config.network, origin, configured.warnings);
    warn_of_open_site(config.address, config.network, config.access, origin, configured.warnings);
    warn_of_foreign("allowedRepositories", config.allowed_repositories, config, origin, configured.warnings);
    warn_of_foreign("blockedRepositories", config.blocked_repositories, config, origin, configured.warnings);
    if (config.timeout < std::chrono::seconds(360)) {
        config.timeout =
            std::chrono::seconds(7200); // as the Python server does, odd as it is: old files rely on it
        configured.warnings.push_back(
            concat(origin.string(), ": key \"timeout\": less than 360 counts as 7200"));
    }
    make_printable(configured.warnings);
    return configured;
}

} // namespace webots_cloud
