// How a simulator is confined by firejail: what it sees of the file system, as a profile and a command line.
#pragma once

#include "visible.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Where firejail keeps its files. Simulators of root's could change them, so each gets a folder of its own
/// in place of this one.
inline constexpr char const* firejail_files = "/run/firejail";

/// What the profile of firejail depends on.
struct FirejailMachine
{
    FirejailMachine() = default;

    std::vector<std::filesystem::path> folders; ///< All of `/`, not links.
    std::vector<std::filesystem::path> files;   ///< All others of `/`: files, links, sockets.
    std::vector<std::string> name_servers;      ///< Their addresses, as `/etc/resolv.conf` is to have them.
    bool has_graphics = false;                  ///< There are graphics processors.
};

/// The addresses of the name servers in the text of a file like `/etc/resolv.conf`: three at most, as
/// libraries use them.
std::vector<std::string> name_servers(std::string_view resolver);

/// The text of a profile for all simulators of this machine. Folders of `/` that are not the system's are
/// empty and in memory, but for what the command line shows of them. Simulators have no capability and can't
/// get any.
std::string firejail_profile(FirejailMachine const& machine);

/// The command line that runs `argv` so, in the current folder, with this profile in a file. firejail must
/// run as root, outside of any PID namespace: in one it believes that it is in a sandbox already, and
/// confines nothing.
///
/// The network is not firejail's: see `ProcessNetwork`. The resolver of `visible` is the profile's, and its
/// devices are those that firejail knows.
std::vector<std::string> firejail_command(std::filesystem::path const& firejail,
                                          std::filesystem::path const& profile, Visible const& visible,
                                          std::vector<std::string> const& argv);

} // namespace webots_cloud::core
