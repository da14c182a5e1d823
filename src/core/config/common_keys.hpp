// What the configurations of both servers have in common: keys, and warnings about them.
#pragma once

#include "config_reader.hpp"

#include <webots_cloud/config.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

inline constexpr int max_port = 65535;

/// "$schema", which is for editors alone.
void read_schema(ConfigReader& reader);

/// A number of seconds, fractions too.
void read_seconds(ConfigReader& reader, std::string_view key, Duration& value);

/// "port"; `highest`: where other keys leave less than the table of keys allows.
void read_port(ConfigReader& reader, std::uint16_t& value, std::optional<int> highest = {});

/// A list of addresses and networks, as in `10.0.0.0/8`.
void read_networks(ConfigReader& reader, std::string_view key, std::vector<std::string>& networks);

/// The name of a host. Empty is taken, as the Python servers do.
void read_server_name(ConfigReader& reader, std::string_view key, std::string& server);

/// Certificate, addresses, limits of connections. `port`: that of this configuration.
void read_network(ConfigReader& reader, std::uint16_t port, NetworkConfig& network);

/// Who may use the server.
void read_access(ConfigReader& reader, AccessConfig& access);

/// What was read of the key "labels" of a simulation server.
void check_labels(ConfigReader& reader, std::vector<std::string> const& labels);

/// How the server logs.
template<class Config>
void read_log(ConfigReader& reader, Config& config)
{
    reader.read("logDir", config.log_dir);
    reader.read("debug", config.debug);
    std::string format = "text";
    reader.read_choice("logFormat", format);
    config.json_log = format == "json";
}

enum class Port
{
    optional,
    required
};

/// What may stand between `https://` and the first slash: a proxy may have a port of its own.
bool is_authority(std::string_view text, Port port = Port::optional);

void warn_of_trust_in_everybody(NetworkConfig const& network, std::filesystem::path const& origin,
                                std::vector<std::string>& warnings);

/// A site that speaks TLS to the world has chosen who may use it, or is told how.
void warn_of_open_site(PublicAddress const& address, NetworkConfig const& network, AccessConfig const& access,
                       std::filesystem::path const& origin, std::vector<std::string>& warnings);

/// Warnings quote the configuration and name its file, and are printed on terminals.
void make_printable(std::vector<std::string>& warnings);

} // namespace webots_cloud::core
