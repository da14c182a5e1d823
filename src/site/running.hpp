// The servers of a site that run now.
#pragma once

#include "servers.hpp"
#include "settings.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::site {

/// Where the site is.
struct Place
{
    Place() = default;

    std::string folder;   ///< Of the checkout, ours as well.
    std::string programs; ///< `build/release/bin` in it.
};

/// The server of a kind that runs, if any. Nothing is changed.
std::optional<Process> running_server(Place const& place, Kind kind);

/// The same, once our own files are in order: what is in the place of a file of ours is set aside, one that
/// names no server is removed, and one that is missing is written.
/// Errors: `unavailable`.
result<std::optional<Process>> known_server(Place const& place, Kind kind);

/// Who keeps a server from getting `port`, in a sentence that says what to do. `otherwise`: the end of the
/// sentence that names the places to change the port.
std::string port_taken(Settings const& settings, std::string const& name, std::uint16_t port,
                       std::string const& otherwise);

/// Ends a server, and says so.   Errors: `refused`, `timed_out`, in a sentence.
result<> stop_server(Kind kind, Process const& process);

/// As in `Started local session server (4711)`, for people.
std::string with_number(std::string_view what, pid_t process);

} // namespace webots_cloud::site
