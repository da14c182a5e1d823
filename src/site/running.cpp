#include "running.hpp"

#include "adapters/host/accounts.hpp"
#include "app/daemon.hpp"
#include "core/text.hpp"
#include "launch.hpp"
#include "log_folder.hpp"
#include "port_holder.hpp"
#include "process_table.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <iostream>

#include <unistd.h>

namespace webots_cloud::site {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr std::chrono::seconds end_patience(30);
constexpr std::size_t max_table = std::size_t{64} << 20;

std::vector<Listener> listeners_of(std::uint16_t port)
{
    std::vector<Listener> all;
    for (auto const* const table : {"/proc/net/tcp", "/proc/net/tcp6"})
        if (auto const text = read_regular_file(table, max_table))
            for (auto const& each : parse_listeners(*text, port))
                all.push_back(each);
    return all;
}

std::vector<Suspect> suspects()
{
    std::vector<Suspect> all;
    for (auto& process : all_processes()) {
        Suspect suspect;
        suspect.sockets = sockets_of(process);
        if (auto const server = parse_server(process.arguments))
            if (auto const settings = read_settings(server->kind, configuration_path(*server), server->moved))
                suspect.ports = ports_of(*settings);
        suspect.process = std::move(process);
        all.push_back(std::move(suspect));
    }
    return all;
}

Holder find_holder(std::uint16_t port)
{
    auto const all = suspects();
    auto const* const found = holder_of(port, listeners_of(port), all);
    if (!found)
        return {};
    auto const& process = found->process;
    auto const server = parse_server(process.arguments);
    std::error_code ignored;
    bool const has_script = server && fs::exists(fs::path(checkout_of(*server)) / "server.sh", ignored);
    bool const is_ours = process.user == ::geteuid() || ::geteuid() == 0;
    auto const name = is_ours ? std::string() : adapters::find_user_name(process.user);
    return describe_holder(process, is_ours || !name.empty() ? name : std::to_string(process.user),
                           has_script);
}

} // namespace

std::optional<Process> running_server(Place const& place, Kind kind)
{
    auto const processes = all_processes();
    auto const* const found = find_server(processes, kind, place.folder, noted_process(kind), ::geteuid());
    return found ? std::optional(*found) : std::nullopt;
}

result<std::optional<Process>> known_server(Place const& place, Kind kind)
{
    if (auto const usable = set_aside_unless_file(pid_file(kind)); !usable)
        return usable.error();
    auto found = running_server(place, kind);
    if (!found)
        forget_process(kind);
    else if (noted_process(kind) != found->id)
        (void)note_process(kind, found->id); // it is found without, too
    return found;
}

std::string port_taken(Settings const& settings, std::string const& name, std::uint16_t port,
                       std::string const& otherwise)
{
    auto const holder = find_holder(port);
    return concat("Port ", std::to_string(port), " is in use by ", holder.who, ": ", name, " ",
                  called(settings.kind), " not started. ", holder.remedy, "; or ", otherwise, ".");
}

result<> stop_server(Kind kind, Process const& process)
{
    auto const who = with_number(concat("The ", called(kind)), process.id);
    auto const ended = end_process(process, end_patience);
    if (!ended && ended.error() == errc::refused)
        return Failure(errc::refused, who + " belongs to another user.");
    if (!ended)
        return Failure(errc::timed_out, concat(who, " has not ended within ",
                                               std::to_string(end_patience.count()), " seconds."));
    forget_process(kind);
    return {};
}

std::string with_number(std::string_view what, pid_t process)
{
    return concat(what, " (", std::to_string(process), ")");
}

} // namespace webots_cloud::site
