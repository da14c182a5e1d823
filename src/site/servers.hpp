// Which processes are servers of a site, and of which one. The facts come from proc(5); deciding is pure.
#pragma once

#include "kinds.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

namespace webots_cloud::site {

/// A process that lives.
struct Process
{
    Process() = default;

    pid_t id = 0;
    uid_t user = 0;
    std::uint64_t began = 0;            ///< Clock ticks after the machine was booted.
    std::vector<std::string> arguments; ///< What it says itself: any process can say anything.
    std::string program;   ///< The file that it runs, as the kernel says; empty: it does not tell us.
    bool is_inner = false; ///< It is in a PID namespace below ours, as simulations are.
    bool is_moved = false; ///< What its command line names is not there, as after a folder was renamed.
};

/// What the command line of a server says.
struct ServerCommand
{
    ServerCommand() = default;

    Kind kind = Kind::session;
    std::string programs;      ///< The folder that it was started from; empty: one of PATH.
    std::string configuration; ///< As given; empty: none was.
    int moved = 0;             ///< `--move-ports`
};

/// Whether the kernel says otherwise than its command line. `called`: the file that the command line leads
/// to, without links. A simulation that calls itself a server would keep the server from being started.
bool is_posing(Process const& process, std::string_view called) noexcept;

/// Nothing: it is no server of ours.
std::optional<ServerCommand> parse_server(std::vector<std::string> const& arguments);

/// The checkout whose `build/release/bin` the server was started from; empty: it was installed, say.
std::string_view checkout_of(ServerCommand const& server) noexcept;

/// The file itself: paths begin in the folder of the checkout, where server.sh starts servers.
std::string configuration_path(ServerCommand const& server);

/// As `local` of `config/session/local.json`.
std::string name_of(ServerCommand const& server);

/// The server of this kind of the site in `folder`, or null. Its number is `noted`, unless that is another
/// program's by now; or it has none, as where its `log` was removed, and is known by its program and its
/// configuration. Where the folder was renamed while it ran, the note has come along. `user`: who asks.
/// Whatever others run by such a name is theirs.
Process const* find_server(std::vector<Process> const& processes, Kind kind, std::string_view folder,
                           std::optional<pid_t> noted, uid_t user);

/// When a process began, from `/proc/<id>/stat`; nothing: it has ended.
std::optional<std::uint64_t> parse_beginning(std::string_view stat);

} // namespace webots_cloud::site
