// The steps of a start: all that can go wrong before a server is started or stopped, and the servers, one
// after the other. Either all run in the end, or those that this start has started are stopped again.
#pragma once

#include "running.hpp"
#include "settings.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::site {

/// What is to run.
struct StartedSite
{
    StartedSite() = default;

    std::string name;
    int moved = 0;                 ///< `--move-ports` of all servers.
    std::vector<Settings> servers; ///< In the order in which they start.
};

/// Errors: `not_found`: there is no server to start with such a configuration.
result<> find_configurations(std::string const& name);

/// By how much the ports are moved that the configurations name. `port`: the one that people open, of the
/// session server if there is one; 0: as the site runs, if it does.
/// Errors: `invalid_argument`.
result<int> moved_ports(Place const& place, std::string const& name, std::uint16_t port);

/// Makes certificate and password where they are missing, and has each server check its configuration.
/// Changes nothing else. Errors: what is wrong, in the words of the server; any code.
result<StartedSite> prepare(Place const& place, std::string const& name, int moved);

/// Starts those that don't run, says so, and waits for their answers.
/// Errors: any code; what was started is stopped.
result<> start_servers(Place const& place, StartedSite const& site);

/// Of a file in `log`; empty: it is elsewhere, or has none.
std::string first_line_of_ours(std::filesystem::path const& file);

} // namespace webots_cloud::site
