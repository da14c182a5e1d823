// The simulation server's configuration beyond its table of keys: values with shapes of their own (forges,
// staged, launcher), keys that need or exclude each other, values that follow from others, and warnings about
// what is allowed but seldom meant.
#include <webots_cloud/config.hpp>

#include "config_rules.hpp"
#include "core/access/asked_name.hpp"
#include "core/docker/docker_project.hpp"
#include "core/forge_link.hpp"
#include "core/projects/repository_policy.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/text.hpp"

#include <boost/url/authority_view.hpp>
#include <boost/url/parse.hpp>

#include <algorithm>
#include <optional>

namespace webots_cloud {
namespace {

using namespace core;

namespace fs = std::filesystem;

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

bool is_web_url(std::string_view url)
{
    return (url.starts_with("https://") || url.starts_with("http://")) && core::is_printable(url);
}

void read_forge(ConfigReader& reader, std::size_t number, boost::json::value const& entry,
                fs::path const& folder, ForgeConfig& forge)
{
    if (auto const* url = entry.if_string()) {
        forge.url = without_final_slash(std::string(*url));
        if (!is_web_url(forge.url))
            reader.refuse_entry("forges", number, entry, "a URL that starts with https:// or http://");
    } else if (auto const* object = entry.if_object()) {
        auto inner = reader.entry("forges", number, *object);
        inner.read_members(forge);
        if (!inner.has("url"))
            inner.require("url", "the beginning of the addresses of its worlds, as in \"local:\"");
        std::string kind;
        inner.read_choice("kind", kind);
        forge.kind = core::forge_kind(kind);
        forge.url = without_final_slash(std::move(forge.url));
        if (inner.has("directory"))
            forge.directory = (folder / forge.directory).lexically_normal();
        else if (!is_web_url(forge.url))
            inner.require("directory", "a folder");
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
                             "a list of base URLs, or of objects {\"url\": ..., \"directory\": ...}",
                             list_advice(*found));
    forges.clear();
    for (auto const& entry : *list) {
        auto& forge = forges.emplace_back();
        read_forge(reader, forges.size(), entry, folder, forge);
    }
}

void read_staged_world(ConfigReader& reader, std::vector<ForgeAddress> const& forges,
                       StagedWorldConfig& world)
{
    reader.read_members(world);
    if (!reader.has("url"))
        return reader.require("url", "the address of a world");
    if (auto const parsed = parse_world_url(world.url, forges); !parsed && !reader.is_refused("url"))
        reader.refuse("url", "the address of a world on one of the \"forges\"",
                      concat(": ", printable(parsed.error().message(), 300)));
}

/// Only simulations that are programs of this machine are staged: a job would hold its node, and containers
/// hold their images and networks.
void read_staged(ConfigReader& reader, SimulationConfig& config)
{
    bool const is_program = !config.docker && !config.slurm;
    auto& for_classes = config.service.staged_for_classes;
    if (!is_program && !reader.has("stagedForClasses"))
        for_classes = 0;
    if (!is_program && for_classes > 0)
        reader.refuse("stagedForClasses", "0 together with \"docker\" or \"launcher\"");
    auto const* found = reader.find("staged");
    if (!found)
        return;
    auto const* list = found->if_array();
    if (!list)
        return reader.refuse("staged", "a list of objects, as in [{\"url\": ..., \"count\": 2}]");
    if (!list->empty() && !is_program)
        return reader.refuse("staged", "[] together with \"docker\" or \"launcher\"");
    std::vector<ForgeAddress> forges;
    for (auto const& forge : config.forges)
        forges.emplace_back(forge.url, forge.kind);
    for (auto const& entry : *list) {
        auto& world = config.service.staged.emplace_back();
        auto const number = config.service.staged.size();
        if (auto const* object = entry.if_object()) {
            auto inner = reader.entry("staged", number, *object);
            read_staged_world(inner, forges, world);
            reader.take_over(inner);
        } else {
            reader.refuse_entry("staged", number, entry, "an object, as in {\"url\": ..., \"count\": 2}");
        }
    }
}

void read_notify(ConfigReader& reader, std::vector<std::string>& registries)
{
    registries = {"https://webots.cloud/ajax/server/setup.php"};
    auto const* found = reader.find("notify");
    if (found && found->is_string())
        registries = {std::string(found->get_string())};
    else
        reader.read("notify", registries);
    if (found && !std::all_of(registries.begin(), registries.end(), is_web_address))
        reader.refuse("notify", "addresses that start with https:// or http://, or [] for none");
}

void complete_session_servers(ConfigReader& reader, std::vector<std::string>& session_servers)
{
    if (!std::all_of(session_servers.begin(), session_servers.end(), is_web_address))
        reader.refuse("sessionServers", "addresses that start with https:// or http://");
    for (auto& session_server : session_servers)
        while (session_server.ends_with('/'))
            session_server.pop_back();
    if (!session_servers.empty() && !reader.has("sessionSecret"))
        reader.require("sessionSecret", "the file of a word that the session servers know, since this server "
                                        "announces itself to them (\"sessionServers\")");
}

/// Simulations have the ports after the server's, and in containers editors those 500 above them.
void limit_connections(SimulationConfig& config, fs::path const& origin, std::vector<std::string>& warnings)
{
    int const room = (config.docker ? max_port - core::editor_distance : max_port) - config.address.port;
    if (config.launching.max_simulations <= room)
        return;
    warnings.push_back(
        concat(origin.string(), ": key \"maxConnections\": only ", std::to_string(room),
               " simulations at once instead of ", std::to_string(config.launching.max_simulations),
               ", since there are no more ports above \"port\" (", std::to_string(config.address.port), ")"));
    config.launching.max_simulations = room;
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

/// libController takes apart `tcp://<host>:<port>/...` at the first colon. A port may follow by which a
/// session server knows this machine.
bool is_controller_address(std::string_view address)
{
    if (auto const slash = address.find('/'); slash != std::string_view::npos) {
        if (core::parse_port(address.substr(slash + 1)) == 0)
            return false;
        address = address.substr(0, slash);
    }
    auto const colon = address.find(':');
    return colon != std::string_view::npos && is_authority(address) &&
           core::parse_port(address.substr(colon + 1)) != 0;
}

void check_controllers(core::ConfigReader& reader, SimulationConfig const& config)
{
    auto const& service = config.service;
    int const port = service.controller_port;
    int const last = config.address.port + config.launching.max_simulations;
    if (port != 0 && port >= config.address.port && port <= last)
        reader.refuse("controllerPort",
                      concat("a port that neither this server nor a simulator has, which have ",
                             std::to_string(config.address.port), " to ", std::to_string(last)));
    else if (port != 0 && port == config.network.redirect_port)
        reader.refuse("controllerPort", "another port than \"redirectPort\"");
    if (!service.controller_address.empty() && !is_controller_address(service.controller_address))
        reader.refuse(
            "controllerAddress",
            "a name, or an address of IPv4, and a port, as in \"sim.example.org:2900\", or with the port of "
            "this machine at a session server, \"sim.example.org:2900/2000\"");
}

/// Keys for controllers of which one alone opens nothing.
void warn_of_closed_controllers(SimulationConfig const& config, fs::path const& origin,
                                std::vector<std::string>& warnings)
{
    auto const& service = config.service;
    bool const has_port = service.controller_port != 0;
    auto const warn = [&](std::string_view key, std::string_view why) {
        warnings.push_back(concat(origin.string(), ": key \"", key, "\" has no effect, since ", why));
    };
    if (has_port && !config.launching.gateway)
        warn("controllerPort", "\"gateway\" is false: controllers reach simulators at their own ports");
    else if (has_port && service.controller_repositories.empty())
        warn("controllerPort", "\"controllerRepositories\" names no project whose robots may be controlled "
                               "from other machines");
    if (!has_port && !service.controller_repositories.empty())
        warn("controllerRepositories", "there is no \"controllerPort\"");
    warn_of_foreign("controllerRepositories", service.controller_repositories, config, origin, warnings);
}

void warn_of_plain_simulators(SimulationConfig const& config, fs::path const& origin,
                              std::vector<std::string>& warnings)
{
    if (config.launching.gateway || config.network.ssl_certificate.empty() || !config.address.ssl ||
        config.address.port_rewrite || !config.address.path.empty())
        return;
    warnings.push_back(concat(
        origin.string(), ": browsers are sent to wss://", config.address.host,
        ":<port of the simulation>, but simulators speak no TLS, whatever \"sslCertificate\" says: no "
        "simulation can be shown. Set \"gateway\" to true, or let a proxy end TLS, as in config/nginx, and "
        "set \"portRewrite\" to true"));
}

void warn_of_assumed_tls(ConfigReader const& reader, SimulationConfig const& config, fs::path const& origin,
                         std::vector<std::string>& warnings)
{
    bool const is_told = !config.network.ssl_certificate.empty(); // by warn_of_plain_simulators
    if (reader.has("ssl") || config.address.port_rewrite || !config.address.path.empty() || is_told)
        return;
    if (config.launching.gateway) {
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
void check_multimedia(ConfigReader& reader, SimulationConfig const& config)
{
    constexpr auto* separators = " \t\";";
    if (config.launching.multimedia_server.find_first_of(separators) != std::string::npos)
        reader.refuse("multimediaServer", "an address without spaces, quotes and semicolons");
    if (config.launching.multimedia_stream.find_first_of(separators) != std::string::npos)
        reader.refuse("multimediaStream", "an address without spaces, quotes and semicolons");
}

void check_simulator_environment(ConfigReader& reader, SimulationConfig const& config)
{
    constexpr std::string_view key = "simulatorEnvironment";
    constexpr std::size_t longest = 128 * 1024; // of all entries: no program is started with much more
    auto const& entries = config.launching.simulator_environment;
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

/// Containers are one of the sandboxes; `docker`, the older key, chooses the same.
void complete_sandbox(ConfigReader& reader, SimulationConfig& config)
{
    bool const wants_docker = config.sandbox == "docker";
    if (wants_docker && reader.has("docker") && !config.docker)
        reader.refuse("sandbox", "another one than \"docker\", since \"docker\" is false");
    if (config.docker && !wants_docker && config.sandbox != "auto")
        reader.refuse("sandbox", "\"docker\" or \"auto\", since \"docker\" is true");
    config.docker = config.docker || wants_docker;
}

/// What a job asks for ends up in the arguments of `srun`, each of which is one word.
void check_slurm_job(ConfigReader& reader, SlurmJobConfig const& job)
{
    for (auto const& [key, value] :
         {std::pair<std::string_view, std::string const&>("partition", job.partition),
          {"account", job.account},
          {"qos", job.qos},
          {"gres", job.gres}})
        if (value.find_first_of(" |") != std::string::npos)
            reader.refuse(key, "a name without spaces and |");
}

void check_slurm_override(ConfigReader& reader, SlurmOverrideConfig const& entry)
{
    if (!entry.mode.empty() && !is_known_mode(entry.mode))
        reader.refuse("mode", "\"x3d\", \"w3d\" or \"mjpeg\"");
    check_slurm_job(reader, entry.job);
}

void read_slurm(ConfigReader& reader, SlurmConfig& slurm)
{
    reader.read_members(slurm);
    check_slurm_job(reader, slurm.job);
    std::string copy_to;
    reader.read("copyTo", copy_to);
    slurm.copy_to = copy_to;
    if (!copy_to.empty() && !slurm.copy_to.is_absolute())
        reader.refuse("copyTo", "an absolute path, which is one of the nodes");
    auto const* found = reader.find("overrides");
    if (!found)
        return;
    auto const* list = found->if_array();
    if (!list)
        return reader.refuse("overrides", "a list of objects");
    for (auto const& entry : *list) {
        auto const number = slurm.overrides.size() + 1;
        auto& override = slurm.overrides.emplace_back();
        override.job = slurm.job;
        if (auto const* object = entry.if_object()) {
            auto inner = reader.entry("overrides", number, *object);
            inner.read_members(override);
            check_slurm_override(inner, override);
            reader.take_over(inner);
        } else {
            reader.refuse_entry("overrides", number, entry, "an object");
        }
    }
}

/// Where simulations run. What runs elsewhere is reached through this server alone, and has no containers.
void read_launcher(ConfigReader& reader, SimulationConfig& config)
{
    auto const* found = reader.find("launcher");
    if (!found)
        return;
    auto const* object = found->if_object();
    if (!object)
        return reader.refuse("launcher", "an object, as in {\"slurm\": {}}");
    auto launcher = reader.inside("launcher", *object);
    if (auto const* slurm = launcher.find("slurm"); slurm && slurm->is_object()) {
        auto inner = launcher.inside("slurm", slurm->get_object());
        read_slurm(inner, config.slurm.emplace());
        launcher.take_over(inner);
    } else if (slurm) {
        launcher.refuse("slurm", "an object, as in {\"partition\": \"simulations\"}");
    }
    reader.take_over(launcher);
    if (config.slurm && config.docker)
        reader.refuse("launcher", "no \"slurm\" together with \"docker\"");
    if (config.slurm && config.simulation_user != "auto" && config.simulation_user != "none")
        reader.refuse("simulationUser", "\"auto\" or \"none\", since jobs of Slurm are this server's user's");
    if (config.slurm && !config.launching.gateway)
        reader.refuse("launcher", "no \"slurm\" where \"gateway\" is false: browsers don't reach nodes");
}

/// Simulations have the ports after it, and their editors those 500 above.
void check_port(ConfigReader& reader, SimulationConfig const& config)
{
    constexpr int highest = max_port - 1 - core::editor_distance;
    if (config.docker && config.address.port > highest)
        reader.refuse("port", concat("an integer from 1 to ", std::to_string(highest)));
}

} // namespace

result<Configured<SimulationConfig>> parse_simulation_config(std::string_view text,
                                                             std::filesystem::path const& origin)
{
    auto reader =
        ConfigReader::parse(text, origin, simulation_topics(), {"webots-session-server", session_topics()});
    if (!reader)
        return reader.error();
    Configured<SimulationConfig> configured;
    auto& config = configured.config;
    reader->read_members(config);
    for (std::string_view const key : {"fullyQualifiedDomainName", "server"}) {
        read_server_name(*reader, key, config.address);
        warn_of_two_ports(*reader, key, config.address);
    }
    complete_sandbox(*reader, config);
    check_port(*reader, config);
    check_network(*reader, config.address.port, config.network);
    check_access(*reader, config.access);
    config.containers.directory = (origin.parent_path() / config.containers.directory).lexically_normal();
    read_forges(*reader, origin.parent_path(), config.forges);
    read_notify(*reader, config.service.notify);
    complete_session_servers(*reader, config.session_servers);
    if (config.address.host == core::asked_name)
        config.service.notify.clear(); // there is no address that could be registered
    check_labels(*reader, config.labels);
    read_launcher(*reader, config);
    read_staged(*reader, config);
    check_simulator_environment(*reader, config);
    if (config.docker && config.launching.max_simulations >= core::editor_distance)
        reader->refuse(
            "maxConnections",
            "at most 499 with \"docker\", since the port of an editor is 500 above that of its simulation");
    check_multimedia(*reader, config);
    check_controllers(*reader, config);
    if (auto const failure = reader->failure())
        return *failure;
    if (config.launching.timeout < std::chrono::seconds(360)) {
        config.launching.timeout =
            std::chrono::seconds(7200); // as the Python server does, odd as it is: old files rely on it
        reader->warn("timeout", "less than 360 counts as 7200");
    }
    configured.warnings = reader->warnings();
    if (!reader->has("server") && !reader->has("fullyQualifiedDomainName"))
        configured.warnings.push_back(
            concat(origin.string(), ": key \"server\" is missing: browsers are sent to \"localhost\", which "
                                    "is right only on this machine"));
    limit_connections(config, origin, configured.warnings);
    warn_of_plain_simulators(config, origin, configured.warnings);
    if (!config.launching.gateway && config.service.traffic_limit > 0)
        configured.warnings.push_back(
            concat(origin.string(), ": key \"trafficLimit\" has no effect, since \"gateway\" is false"));
    warn_of_closed_controllers(config, origin, configured.warnings);
    warn_of_assumed_tls(*reader, config, origin, configured.warnings);
    warn_of_trust_in_everybody(config.network, origin, configured.warnings);
    warn_of_open_site(config.address, config.network, config.access, origin, configured.warnings);
    warn_of_foreign("allowedRepositories", config.service.repositories.allowed, config, origin,
                    configured.warnings);
    warn_of_foreign("blockedRepositories", config.service.repositories.blocked, config, origin,
                    configured.warnings);
    make_printable(configured.warnings);
    return configured;
}

result<> core::complete_choices(SimulationConfig& config)
{
    for (auto const& topic : simulation_topics())
        for (auto const& key : topic.keys) {
            if (key.value.type != KeyType::choice)
                continue;
            auto const found = key.value.as_json(key, &config);
            auto const is_found = [&](auto choice) { return found == concat("\"", choice, "\""); };
            if (std::ranges::none_of(key.choices, is_found))
                return Failure(errc::invalid_config,
                               concat("key \"", key.name, "\": expected ", one_of(key.choices), ", found ",
                                      found.empty() ? "no text" : found));
        }
    config.docker = config.docker || config.sandbox == "docker";
    return {};
}

} // namespace webots_cloud
