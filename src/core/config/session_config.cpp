// The session server's configuration beyond its table of keys: the entries of machines, keys that need or
// exclude each other, values that follow from others, and warnings about what is allowed but seldom meant.
#include <webots_cloud/config.hpp>

#include "config_rules.hpp"
#include "core/access/asked_name.hpp"
#include "core/access/controller_greeting.hpp"
#include "core/access/forwarding.hpp"
#include "core/access/ip_address.hpp"
#include "core/access/site_access.hpp"
#include "core/discovery/machine_name.hpp"
#include "core/gallery/world_list.hpp"
#include "core/notices/mail_message.hpp"
#include "core/public_place.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

namespace webots_cloud {
namespace {

using namespace core;

namespace fs = std::filesystem;

constexpr std::size_t least_password = 8; // as in its file

bool is_server_address(std::string_view text)
{
    auto const path = path_in(text);
    if (path.empty())
        return is_authority(text, Port::required);
    return is_authority(text.substr(0, text.size() - path.size())) && is_machine_path(path);
}

/// A machine, or a name for several.
bool is_server_entry(std::string_view text)
{
    return text == announced_entry ||
           (is_machine_name(text) ? parse_machine_name(text).has_value() : is_server_address(text));
}

/// How the session server itself reaches machines that are found.
void read_way_inside(ConfigReader& inner, ServerSpec& server)
{
    std::string ports;
    inner.read("ports", ports);
    if (inner.has("ports"))
        inner.refuse("ports", "no such key beside a name of several machines");
    if (!inner.has("internal"))
        return;
    auto const way = parse_way_inside(server.internal_address);
    bool const is_service = server.address.starts_with("srv:");
    bool const may_name = !is_service && server.address != announced_entry;
    if (!way || (!way->name.empty() && !may_name))
        inner.refuse("internal", may_name
                                     ? "\"http\", \"https\", or \"https://name\" with the name that all "
                                       "certificates of these machines are for"
                                     : "\"http\" or \"https\": browsers reach these machines through the "
                                       "gateway, which reaches them at their addresses");
    else if (is_service && !way->tls)
        inner.refuse("internal", "\"https\": names are no proof of who answers, without certificates");
}

/// Where a machine takes controllers, which find it by its port.
void check_controllers_place(ConfigReader& inner, ServerSpec const& server)
{
    auto const place = core::parse_internal_address(server.controllers);
    if (inner.has("controllers") && (!place || place->tls))
        inner.refuse("controllers", "a numeric address and a port, as in \"10.0.0.2:2900\"");
    else if (inner.has("controllers") && core::port_of_machine(server.address) == 0)
        inner.refuse("controllers",
                     "no such key without a port at the end of \"address\", by which controllers "
                     "find the machine");
}

/// Where the session server itself reaches a machine, and which of its ports.
void read_internal_address(ConfigReader& inner, ServerSpec& server)
{
    if (stands_for_found(server.address))
        return read_way_inside(inner, server);
    auto const machine = core::parse_internal_address(server.internal_address);
    if (inner.has("internal") && !machine)
        inner.refuse("internal", "a numeric address and a port, as in \"10.0.0.2:2000\", or for TLS "
                                 "\"https://sim2.example.org:2000\"");
    std::string ports;
    inner.read("ports", ports);
    auto const range = core::parse_port_range(ports);
    if (inner.has("ports") && !range)
        inner.refuse("ports", "a port or a range of ports, as in \"2001-2100\"");
    if (inner.has("ports") && machine && machine->tls)
        inner.refuse("ports", "none with https, which simulators do not speak: the simulation server's own "
                              "\"gateway\" passes on to them");
    if (range)
        std::tie(server.first_port, server.last_port) = *range;
}

/// What to write instead of an address that is nearly one.
std::string machine_advice(std::string_view text)
{
    constexpr std::string_view usual_port = ":2000";
    if (auto const scheme = text.find("://"); scheme != std::string_view::npos)
        text.remove_prefix(scheme + 3);
    while (text.ends_with('/'))
        text.remove_suffix(1);
    bool const is_name = text.find('/') == std::string_view::npos && is_authority(text);
    if (is_server_entry(text))
        return concat(": write \"", text, "\"");
    return is_name ? concat(": write \"", text, usual_port, "\", if that is its port") : std::string();
}

/// An entry of `simulationServers`: an address, or an object with an address and how to treat it.
void read_simulation_server(ConfigReader& reader, std::size_t number, boost::json::value const& entry,
                            ServerSpec& server)
{
    constexpr std::string_view key = "simulationServers";
    constexpr std::string_view address =
        "\"host:port\", \"host/port\" or \"host/path\", with a port from 1 to "
        "65535, \"dns:name:port\", \"srv:service name\" or \"announced\"";
    if (auto const* text = entry.if_string()) {
        server.address = *text;
        if (!is_server_entry(server.address))
            reader.refuse_entry(key, number, entry, address, machine_advice(server.address));
    } else if (auto const* object = entry.if_object()) {
        auto inner = reader.entry(key, number, *object);
        inner.read_members(server);
        check_labels(inner, server.labels);
        read_internal_address(inner, server);
        check_controllers_place(inner, server);
        if (!inner.has("address"))
            inner.require("address", address);
        else if (!is_server_entry(server.address))
            inner.refuse("address", address, machine_advice(server.address));
        reader.take_over(inner);
    } else {
        reader.refuse_entry(key, number, entry,
                            concat(address, ", or {\"address\": ..., \"weight\": 2, \"drain\": true}"));
    }
}

/// Machines that are not listed: found by name, or announced by themselves.
void check_discovery(ConfigReader& reader, SessionConfig const& config)
{
    if (config.announcements && !reader.has("sessionSecret"))
        reader.require("sessionSecret",
                       "the file of a word that machines know, since they may announce themselves "
                       "(\"announcements\")");
    auto const is_name_server = [](std::string const& server) {
        auto const with_port = parse_internal_address(server);
        return IpAddress::parse(server) || (with_port && !with_port->tls);
    };
    if (!std::all_of(config.name_servers.begin(), config.name_servers.end(), is_name_server))
        reader.refuse("nameServers",
                      "numeric addresses, with a port or without, as in \"10.0.0.53\" or \"127.0.0.1:8600\"");
}

void read_simulation_servers(ConfigReader& reader, bool is_optional, std::vector<ServerSpec>& servers)
{
    constexpr std::string_view wanted = "a list of \"host:port\" or \"host/port\", or of objects "
                                        "{\"address\": ..., \"weight\": 2, \"drain\": true}";
    auto const* found = reader.find("simulationServers");
    if (!found && is_optional)
        return;
    if (!found)
        return reader.require("simulationServers", wanted);
    if (!found->is_array())
        return reader.refuse("simulationServers", wanted, list_advice(*found));
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

/// `*` is where browsers ask us: that says nothing about where we ask a machine.
void require_internal_addresses(ConfigReader& reader, std::vector<ServerSpec> const& servers)
{
    for (std::size_t i = 0; i < servers.size(); ++i)
        if (servers[i].address.starts_with(core::asked_name) && servers[i].internal_address.empty())
            return reader.refuse_entry(
                "simulationServers", i + 1, boost::json::value(servers[i].address),
                "{\"address\": \"*/2000\", \"internal\": \"127.0.0.1:2000\"}: with the "
                "name \"*\" an entry has to say where the machine is");
}

/// What is said of machines that can't be found, or not be reached.
void refuse_vain_entries(ConfigReader& reader, SessionConfig const& config)
{
    auto const& servers = config.simulation_servers;
    for (std::size_t i = 0; i < servers.size(); ++i) {
        auto const& server = servers[i];
        if (server.address == announced_entry && !config.announcements)
            return reader.refuse_entry("simulationServers", i + 1, boost::json::value(server.address),
                                       "no such entry without \"announcements\": true");
        if (!config.service.gateway && stands_for_found(server.address) && !server.internal_address.empty())
            return reader.refuse_entry("simulationServers", i + 1, boost::json::value(server.address),
                                       "no \"internal\" here, since \"gateway\" is false: browsers would not "
                                       "reach these machines");
    }
}

/// By default there is a gateway where an entry says how machines are reached inside.
void complete_gateway(ConfigReader& reader, SessionConfig& config)
{
    auto& servers = config.simulation_servers;
    if (!reader.has("gateway"))
        config.service.gateway = std::any_of(servers.begin(), servers.end(), [](ServerSpec const& server) {
            return !server.internal_address.empty() &&
                   (core::public_port(server.address) != 0 || stands_for_found(server.address));
        });
    refuse_vain_entries(reader, config);
    if (!config.service.gateway)
        return require_internal_addresses(reader, servers);
    for (auto& server : servers)
        if (auto const port = core::public_port(server.address); port != 0 && server.internal_address.empty())
            server.internal_address = concat("127.0.0.1:", std::to_string(port));
    require_internal_addresses(reader, servers);
    refuse_ambiguous_ports(reader, servers);
}

/// As far as it is seen without a name server.
std::string machine_behind(ServerSpec const& server)
{
    auto const end = server.address.find_last_of(":/");
    auto host = lower_case(server.address.substr(0, end));
    if (reach_of(host) == Reach::this_machine)
        host = "localhost";
    return concat(host, ":", server.address.substr(end + 1));
}

/// A machine that is there twice gets the simulations of two.
void warn_of_the_same_machine(ConfigReader& reader, std::vector<ServerSpec> const& servers)
{
    std::map<std::string, std::size_t> known;
    for (std::size_t i = 0; i < servers.size(); ++i) {
        if (stands_for_found(servers[i].address))
            continue;
        auto const [first, is_new] = known.emplace(machine_behind(servers[i]), i + 1);
        if (!is_new)
            reader.warn_entry("simulationServers", i + 1,
                              concat("\"", servers[i].address, "\" is the machine of entry ",
                                     std::to_string(first->second), " again: remove one of the two"));
    }
}

void check_controllers(ConfigReader& reader, SessionConfig const& config)
{
    auto const& servers = config.simulation_servers;
    auto const port = config.service.controller_port;
    bool const has_machine =
        std::ranges::any_of(servers, [](ServerSpec const& server) { return !server.controllers.empty(); });
    if (port != 0 && (port == config.address.port || port == config.network.redirect_port))
        reader.refuse("controllerPort", "another port than \"port\" and \"redirectPort\"");
    else if (port != 0 && !has_machine)
        reader.warn("controllerPort",
                    "no entry of \"simulationServers\" has \"controllers\": nobody is passed on");
    else if (port == 0 && has_machine)
        reader.warn("simulationServers",
                    "\"controllers\" has no effect, since there is no \"controllerPort\"");
}

void warn_of_machines(ConfigReader& reader, SessionConfig const& config)
{
    auto const& servers = config.simulation_servers;
    if (servers.empty() && !config.announcements)
        reader.warn("simulationServers",
                    "no machine is listed, and nobody can start a simulation: name one, as "
                    "in [\"localhost:2000\"]");
    warn_of_the_same_machine(reader, servers);
    for (std::size_t i = 0; i < servers.size(); ++i) {
        auto const slash = servers[i].address.find('/');
        auto const host = servers[i].address.substr(0, slash);
        bool const is_port =
            slash != std::string::npos && parse_port(servers[i].address.substr(slash + 1)) != 0;
        if (!is_port || !servers[i].internal_address.empty() || reach_of(host) != Reach::this_machine)
            continue;
        reader.warn_entry("simulationServers", i + 1,
                          concat("\"", servers[i].address, "\" is asked at ",
                                 config.address.ssl ? "https://" : "http://", servers[i].address,
                                 "/load, so at port ", config.address.ssl ? "443" : "80",
                                 ", where a proxy has to be. Without a proxy write \"", host, ":",
                                 servers[i].address.substr(slash + 1), "\""));
    }
}

/// The session server knows no forges: what is no address of a world at all is told.
void warn_of_viewer_url(ConfigReader& reader, std::string const& url)
{
    bool const is_world = url.find(':') != std::string::npos && url.ends_with(".wbt");
    if (!url.empty() && !is_world)
        reader.warn("viewerUrl",
                    concat("\"", printable(url, 200),
                           "\" is no address of a world, and the viewer suggests it to everybody: write one "
                           "as in \"https://github.com/<owner>/<repository>/blob/main/worlds/<world>.wbt\""));
}

/// An entry of `worlds`: an address, or an object with an address and what is said of it.
void read_listed_world(ConfigReader& reader, std::size_t number, boost::json::value const& entry,
                       ListedWorld& world)
{
    constexpr std::string_view address =
        "the address of a world or of a folder of worlds, as in \"local:/school/week_1\"";
    auto const is_address = [](std::string_view url) {
        return url.find(':') != std::string_view::npos && is_printable(url);
    };
    if (auto const* text = entry.if_string()) {
        world.url = *text;
        if (!is_address(world.url))
            reader.refuse_entry("worlds", number, entry, address);
    } else if (auto const* object = entry.if_object()) {
        auto inner = reader.entry("worlds", number, *object);
        inner.read_members(world);
        if (!inner.has("url"))
            inner.require("url", address);
        else if (!is_address(world.url))
            inner.refuse("url", address);
        else if (!is_world_link(world.url))
            for (auto const* key : {"title", "text"})
                if (inner.has(key))
                    inner.refuse(key, "no such key beside a folder, whose worlds say that themselves; "
                                      "\"group\" is its heading");
        reader.take_over(inner);
    } else {
        reader.refuse_entry("worlds", number, entry, concat(address, ", or {\"url\": ..., \"title\": ...}"));
    }
}

void read_worlds(ConfigReader& reader, std::optional<std::vector<ListedWorld>>& worlds)
{
    auto const* found = reader.find("worlds");
    if (!found)
        return;
    auto const* list = found->if_array();
    if (!list || list->size() > max_listed_worlds)
        return reader.refuse("worlds",
                             "a list of at most 200 addresses, or of objects {\"url\": ..., \"title\": ...}",
                             list_advice(*found));
    worlds.emplace();
    for (auto const& entry : *list) {
        auto& world = worlds->emplace_back();
        read_listed_world(reader, worlds->size(), entry, world);
    }
}

/// Simulation servers announce simulations below their own `port`.
void warn_of_other_ports(SessionConfig const& config, fs::path const& origin,
                         std::vector<std::string>& warnings)
{
    if (!config.service.gateway)
        return;
    for (auto const& server : config.simulation_servers) {
        auto const port = core::public_port(server.address);
        auto const machine = core::parse_internal_address(server.internal_address);
        if (machine && port != 0 && machine->port != port)
            warnings.push_back(
                concat(origin.string(), ": key \"simulationServers\": ", server.address, " is at ",
                       server.internal_address,
                       ", but a simulation server sends browsers to its own \"port\": set that to ",
                       std::to_string(port), " there, in \"internal\" too"));
    }
}

void check_teacher_password(ConfigReader& reader, SessionConfig const& config)
{
    if (!config.service.teacher_password.empty() && !config.service.teacher_password_file.empty())
        reader.refuse("teacherPasswordFile", "no such key beside \"teacherPassword\": one of the two");
    auto const size = config.service.teacher_password.size();
    if (size > 0 && size < least_password)
        reader.refuse("teacherPassword", "a string of at least 8 characters, since anybody may guess");
}

/// Empty counts as absent: operators switch mails off like that.
void complete_mail(ConfigReader& reader, SessionConfig& config)
{
    if (config.mail.user.empty())
        config.mail.user = config.mail.sender;
    if (!config.mail.administrator.empty() && !core::is_mail_address(config.mail.administrator))
        reader.refuse("administrator", "an e-mail address");
    if (!config.mail.sender.empty() && !core::is_mail_address(config.mail.sender))
        reader.refuse("mailSender", "an e-mail address");
    if (!config.mail.server.empty() && !core::is_mail_host(config.mail.server))
        reader.refuse("mailServer", "the name of a host");
}

void drop_administrator_without_mail(SessionConfig& config, fs::path const& origin,
                                     std::vector<std::string>& warnings)
{
    auto const missing = config.mail.server.empty()   ? "mailServer"
                         : config.mail.sender.empty() ? "mailSender"
                                                      : "";
    if (config.mail.administrator.empty() || !*missing)
        return;
    warnings.push_back(
        concat(origin.string(), ": key \"administrator\" is ignored: no e-mails without \"", missing, "\""));
    config.mail.administrator.clear();
}

/// Until 2021 there was no such key, and plain http unless the server had a certificate.
void warn_of_assumed_tls(ConfigReader const& reader, SessionConfig const& config, fs::path const& origin,
                         std::vector<std::string>& warnings)
{
    auto const has_port = [](ServerSpec const& server) {
        return server.address.find('/') == std::string::npos && !stands_for_found(server.address);
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

} // namespace

result<Configured<SessionConfig>> parse_session_config(std::string_view text,
                                                       std::filesystem::path const& origin)
{
    auto reader = ConfigReader::parse(text, origin, session_topics(),
                                      {"webots-simulation-server", simulation_topics()});
    if (!reader)
        return reader.error();
    Configured<SessionConfig> configured;
    auto& config = configured.config;
    reader->read_members(config);
    if (!reader->has("port"))
        reader->require("port", "an integer from 1 to 65535");
    check_discovery(*reader, config);
    read_simulation_servers(*reader, config.announcements, config.simulation_servers);
    complete_gateway(*reader, config);
    read_server_name(*reader, "server", config.address);
    warn_of_two_ports(*reader, "server", config.address);
    warn_of_machines(*reader, config);
    warn_of_viewer_url(*reader, config.service.viewer_url);
    read_worlds(*reader, config.service.worlds);
    check_network(*reader, config.address.port, config.network);
    check_access(*reader, config.access);
    check_teacher_password(*reader, config);
    complete_mail(*reader, config);
    check_controllers(*reader, config);
    if (auto const failure = reader->failure())
        return *failure;
    configured.warnings = reader->warnings();
    drop_administrator_without_mail(config, origin, configured.warnings);
    warn_of_assumed_tls(*reader, config, origin, configured.warnings);
    warn_of_other_ports(config, origin, configured.warnings);
    warn_of_trust_in_everybody(config.network, origin, configured.warnings);
    warn_of_open_site(config.address, config.network, config.access, origin, configured.warnings);
    make_printable(configured.warnings);
    return configured;
}

} // namespace webots_cloud
