// What both configurations have to keep to beyond the table of keys: what single values must be like, and
// which keys need or exclude each other. Called when all members have been read.
#pragma once

#include "config_reader.hpp"

#include <webots_cloud/config.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

inline constexpr int max_port = 65535;

/// What names a host, and after a slash a path, which goes where it belongs. Empty is taken, as the Python
/// servers do.
void read_server_name(ConfigReader& reader, std::string_view key, PublicAddress& address);

/// Where "portRewrite" is false, and there is no path, "port" follows "server" in what browsers are told.
void warn_of_two_ports(ConfigReader& reader, std::string_view key, PublicAddress const& address);

/// Certificate, addresses, limits of connections. `port`: that of this configuration.
void check_network(ConfigReader& reader, std::uint16_t port, NetworkConfig const& network);

/// Who may use the server.
void check_access(ConfigReader& reader, AccessConfig const& access);

/// For a configuration that a program has made: its choices have to be some that a file could name, and
/// `sandbox` and `docker` agree afterwards.
///
/// Errors: `invalid_config`.
result<> complete_choices(SimulationConfig& config);

/// What was read of the key "labels" of a simulation server.
void check_labels(ConfigReader& reader, std::vector<std::string> const& labels);

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
