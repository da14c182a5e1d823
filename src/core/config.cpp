#include <webots_cloud/config.hpp>

#include "config_reader.hpp"
#include "mail_message.hpp"
#include "text.hpp"

#include <algorithm>
#include <optional>

namespace webots_cloud {
namespace {

using core::concat;
using core::ConfigReader;

constexpr double longest_seconds = 10'000'000;

void read_seconds(ConfigReader& reader, std::string_view key, Duration& value, double least)
{
    double seconds = std::chrono::duration<double>(value).count();
    reader.read_number(key, seconds, least, longest_seconds);
    value = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

void read_port(ConfigReader& reader, std::uint16_t& value, int highest)
{
    int port = value;
    reader.read_integer("port", port, 1, highest);
    value = static_cast<std::uint16_t>(port);
}

void read_network(ConfigReader& reader, NetworkConfig& network)
{
    reader.read("sslCertificate", network.ssl_certificate);
    reader.read("sslKey", network.ssl_key);
    if (network.ssl_certificate.empty() && reader.has("sslKey"))
        reader.require("sslCertificate", "the file of the certificate that \"sslKey\" belongs to");
    if (network.ssl_key.empty() && reader.has("sslCertificate"))
        reader.require("sslKey", "the file of the key that \"sslCertificate\" belongs to");
    reader.read_integer("connectionsPerAddress", network.connections_per_address, 1, 1'000'000);
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

bool is_server_address(std::string const& address)
{
    auto const separator = address.find_last_of(":/");
    if (separator == std::string::npos || separator == 0 || address.find_first_of(" \t\r\n\"<>?#@") != std::string::npos)
        return false;
    auto const port = address.substr(separator + 1);
    return !port.empty() && port.size() <= 5 && port.find_first_not_of("0123456789") == std::string::npos;
}

/// An entry of `simulationServers`: an address, or an object with an address and how to treat it.
std::optional<ServerSpec> read_server(boost::json::value const& entry)
{
    ServerSpec server;
    boost::json::value const* address = &entry;
    if (auto const* object = entry.if_object()) {
        address = object->if_contains("address");
        auto const* weight = object->if_contains("weight");
        auto const* drain = object->if_contains("drain");
        boost::system::error_code ignored;
        server.weight = weight && weight->is_number() ? weight->to_number<double>(ignored) : 1;
        server.drain = drain && drain->is_bool() && drain->get_bool();
        if ((weight && (!weight->is_number() || !(server.weight > 0))) || (drain && !drain->is_bool()))
            return std::nullopt;
    }
    if (!address || !address->is_string())
        return std::nullopt;
    server.address = address->get_string();
    return is_server_address(server.address) ? std::optional(server) : std::nullopt;
}

void read_simulation_servers(ConfigReader& reader, std::vector<ServerSpec>& servers)
{
    constexpr std::string_view wanted = "a list of \"host:port\" or \"host/port\"";
    auto const* found = reader.find("simulationServers");
    if (!found)
        return reader.require("simulationServers", wanted);
    if (!found->is_array())
        return reader.refuse("simulationServers", wanted);
    for (auto const& entry : found->get_array()) {
        auto server = read_server(entry);
        if (!server)
            return reader.refuse("simulationServers", wanted);
        if (auto const* object = entry.if_object())
            reader.expect_keys("simulationServers", *object, {"address", "weight", "drain"});
        servers.push_back(std::move(*server));
    }
}

/// Empty counts as absent: operators switch mails off like that.
void read_mail(ConfigReader& reader, SessionConfig& config)
{
    reader.read("administrator", config.administrator);
    reader.read("mailServer", config.mail_server);
    int port = config.mail_server_port;
    reader.read_integer("mailServerPort", port, 0, 65535);
    config.mail_server_port = static_cast<std::uint16_t>(port);
    reader.read("mailSender", config.mail_sender);
    reader.read("mailSenderUser", config.mail_sender_user);
    reader.read("mailSenderPassword", config.mail_sender_password);
    if (config.mail_sender_user.empty())
        config.mail_sender_user = config.mail_sender;
    if (!config.administrator.empty() && !core::is_mail_address(config.administrator))
        reader.refuse("administrator", "an e-mail address");
    if (!config.mail_sender.empty() && !core::is_mail_address(config.mail_sender))
        reader.refuse("mailSender", "an e-mail address");
    if (!config.mail_server.empty() && !core::is_mail_host(config.mail_server))
        reader.refuse("mailServer", "the name of a host");
}

void drop_administrator_without_mail(SessionConfig& config, std::filesystem::path const& origin,
                                     std::vector<std::string>& warnings)
{
    auto const missing = config.mail_server.empty() ? "mailServer" : config.mail_sender.empty() ? "mailSender" : "";
    if (config.administrator.empty() || !*missing)
        return;
    warnings.push_back(concat(origin.string(), ": key \"administrator\" is ignored: no e-mails without \"", missing, "\""));
    config.administrator.clear();
}

std::string without_final_slash(std::string url)
{
    while (url.ends_with('/'))
        url.pop_back();
    return url;
}

void read_forges(ConfigReader& reader, std::filesystem::path const& folder, std::vector<ForgeConfig>& forges)
{
    constexpr std::string_view wanted = "a list of base URLs, or of objects {\"url\": ..., \"directory\": ...}";
    auto const* found = reader.find("forges");
    if (!found)
        return;
    auto const* list = found->if_array();
    if (!list)
        return reader.refuse("forges", wanted);
    forges.clear();
    for (auto const& entry : *list) {
        ForgeConfig forge;
        if (auto const* url = entry.if_string()) {
            forge.url = without_final_slash(std::string(*url));
            if (!forge.url.starts_with("https://") && !forge.url.starts_with("http://"))
                return reader.refuse("forges", "URLs that start with https:// or http://");
        } else {
            auto const* object = entry.if_object();
            auto const* object_url = object ? object->if_contains("url") : nullptr;
            auto const* directory = object ? object->if_contains("directory") : nullptr;
            if (!object_url || !object_url->is_string() || !directory || !directory->is_string())
                return reader.refuse("forges", wanted);
            forge.url = without_final_slash(std::string(object_url->get_string()));
            reader.expect_keys("forges", *object, {"url", "directory"});
            forge.directory = (folder / core::expand_path(directory->get_string())).lexically_normal();
        }
        forges.push_back(std::move(forge));
    }
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

void read_docker(ConfigReader& reader, std::filesystem::path const& folder, DockerConfig& docker)
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

result<Configured<SessionConfig>> parse_session_config(std::string_view text, std::filesystem::path const& origin)
{
    auto reader = ConfigReader::parse(text, origin);
    if (!reader)
        return reader.error();
    Configured<SessionConfig> configured;
    auto& config = configured.config;
    read_port(*reader, config.port, 65535);
    if (!reader->has("port"))
        reader->require("port", "an integer from 1 to 65535");
    read_simulation_servers(*reader, config.simulation_servers);
    reader->read("server", config.server);
    reader->read("ssl", config.ssl);
    reader->read("portRewrite", config.port_rewrite);
    read_network(*reader, config.network);
    read_log(*reader, config);
    read_seconds(*reader, "loadRefresh", config.load_refresh, 0.1);
    read_seconds(*reader, "loadTimeout", config.load_timeout, 0.1);
    reader->read_number("loadThreshold", config.load_threshold, 1, 1000);
    reader->read_choice("scheduling", config.scheduling, {"least_committed", "least_reported", "random", "power_of_two"});
    read_seconds(*reader, "placementTimeout", config.placement_timeout, 0);
    reader->read("decisionsForAll", config.decisions_for_all);
    reader->read("viewerUrl", config.viewer_url);
    read_mail(*reader, config);
    if (reader->failure())
        return *reader->failure();
    configured.warnings = reader->unknown_keys();
    drop_administrator_without_mail(config, origin, configured.warnings);
    return configured;
}

result<Configured<SimulationConfig>> parse_simulation_config(std::string_view text, std::filesystem::path const& origin)
{
    auto reader = ConfigReader::parse(text, origin);
    if (!reader)
        return reader.error();
    Configured<SimulationConfig> configured;
    auto& config = configured.config;
    reader->read("fullyQualifiedDomainName", config.server);
    reader->read("server", config.server);
    reader->read("ssl", config.ssl);
    read_port(*reader, config.port, 65534); // simulations have the ports after it
    reader->read("portRewrite", config.port_rewrite);
    read_network(*reader, config.network);
    reader->read("docker", config.docker);
    read_docker(*reader, origin.parent_path(), config.containers);
    reader->read("allowedRepositories", config.allowed_repositories);
    reader->read("blockedRepositories", config.blocked_repositories);
    reader->read_number("shareIdleTime", config.share_idle_time, 0, 100);
    read_forges(*reader, origin.parent_path(), config.forges);
    if (auto const* notify = reader->find("notify"); notify && notify->is_string())
        config.notify = {std::string(notify->get_string())};
    else
        reader->read("notify", config.notify);
    double gigabytes = static_cast<double>(config.cache_bytes >> 30);
    reader->read_number("cacheSize", gigabytes, 0.1, 100'000);
    config.cache_bytes = static_cast<std::uint64_t>(gigabytes * (1 << 30));
    reader->read("webotsHome", config.webots_home);
    reader->read("display", config.display);
    reader->read_integer("maxConnections", config.max_connections, 1, 10'000);
    if (config.docker && config.max_connections >= 500)
        reader->refuse(
            "maxConnections",
            "at most 499 with \"docker\", since the port of an editor is 500 above that of its simulation");
    read_seconds(*reader, "timeout", config.timeout, 0);
    read_seconds(*reader, "startTimeout", config.start_timeout, 1);
    read_seconds(*reader, "reconnectGrace", config.reconnect_grace, 0);
    read_log(*reader, config);
    reader->read("title", config.title);
    reader->read("description", config.description);
    std::string formula = "strict";
    reader->read_choice("loadFormula", formula, {"strict", "reference"});
    config.strict_load = formula == "strict";
    reader->read("monitorLogEnabled", config.monitor_log);
    double days = 7;
    reader->read_number("simulationLogDays", days, 0, 3650);
    config.simulation_log_keep = std::chrono::duration_cast<Duration>(std::chrono::duration<double, std::ratio<86400>>(days));
    reader->read("projectsDir", config.projects_dir);
    reader->read("keyDir", config.key_dir);
    read_multimedia(*reader, config);
    reader->ignore({"publicPort"});
    if (reader->failure())
        return *reader->failure();
    configured.warnings = reader->unknown_keys();
    if (!reader->find("server") && !reader->find("fullyQualifiedDomainName"))
        configured.warnings.push_back(concat(
            origin.string(), ": key \"server\" is missing: browsers are sent to \"localhost\", which is right only on this machine"));
    if (config.timeout < std::chrono::seconds(360)) {
        config.timeout = std::chrono::seconds(7200); // as the Python server does, odd as it is: old files rely on it
        configured.warnings.push_back(concat(origin.string(), ": key \"timeout\": less than 360 counts as 7200"));
    }
    return configured;
}

} // namespace webots_cloud
