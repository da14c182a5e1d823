// What a configuration means for whoever starts its server and tells people where it is.
#pragma once

#include "kinds.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::site {

struct Settings
{
    Settings() = default;

    Kind kind = Kind::session;
    std::string file;
    std::vector<std::string> warnings; ///< Of the configuration and the files that it names, a sentence each.
    PublicAddress address;             ///< With the port where it listens.
    std::string listen_address;        ///< Numeric.
    std::uint16_t redirect_port = 0;
    int simulation_ports = 0;          ///< How many after its own its simulations have on this machine.
    std::filesystem::path certificate; ///< Empty: no TLS.
    std::filesystem::path key;
    std::filesystem::path log_dir = "log";
    std::filesystem::path teacher_password_file; ///< Empty: none.
    std::filesystem::path operator_token_file;   ///< Empty: none.
    bool has_classes = false;                    ///< Teachers have a password.
    /// Of a session server: its machines answer it with the configuration that ships. Those that it asks by
    /// https answer only if it trusts their certificates.
    bool hears_machines = false;
};

/// What the server reads, read by the server's own reader, and moved by `--move-ports`.
/// Errors: `invalid_config`, `invalid_argument`.
result<Settings> read_settings(Kind kind, std::string const& file, int moved);

/// The same of text.
result<Settings> parse_settings(Kind kind, std::string const& file, std::string_view text, int moved);

/// All that it listens on.
std::vector<std::uint16_t> ports_of(Settings const& settings);

/// Where programs of this machine reach it.
std::string own_address(std::string_view listen_address);

/// Whether only browsers of this machine reach it.
bool is_for_this_machine(Settings const& settings);

/// Where browsers find a simulation server, with a slash at the end. `session`: the session server of its
/// site, which passes on what is for it where that is at a port of its own; null: there is none.
std::string machine_address(Settings const& settings, Settings const* session);

/// Where browsers find it, with a slash at the end. `host`: where it has no name, as this machine is called.
std::string site_address(Settings const& settings, std::string_view host = "localhost");

} // namespace webots_cloud::site
