#include "servers.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>

namespace webots_cloud::site {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr std::string_view build_folder = "/build/release/bin";
constexpr std::string_view move_option = "--move-ports=";

bool is_whose(uid_t owner, uid_t asking) noexcept
{
    return owner == asking || owner == 0 || asking == 0;
}

} // namespace

bool is_posing(Process const& process, std::string_view called) noexcept
{
    constexpr std::string_view replaced = " (deleted)"; // by a newer build, proc(5)
    std::string_view program = process.program;
    if (program.ends_with(replaced))
        program.remove_suffix(replaced.size());
    return process.is_inner || (!program.empty() && program != called);
}

std::optional<ServerCommand> parse_server(std::vector<std::string> const& arguments)
{
    if (arguments.empty())
        return std::nullopt;
    auto const slash = arguments[0].rfind('/');
    auto const program = slash == std::string::npos ? arguments[0] : arguments[0].substr(slash + 1);
    ServerCommand server;
    auto const* const kind = std::ranges::find(start_order, std::string_view(program), program_of);
    if (kind == start_order.end())
        return std::nullopt;
    server.kind = *kind;
    server.programs = slash == std::string::npos ? "" : arguments[0].substr(0, slash);
    for (auto const& each : std::vector<std::string>(arguments.begin() + 1, arguments.end())) {
        if (each.starts_with(move_option))
            std::from_chars(each.data() + move_option.size(), each.data() + each.size(), server.moved);
        else if (!each.starts_with('-') && server.configuration.empty())
            server.configuration = each;
    }
    return server;
}

std::string_view checkout_of(ServerCommand const& server) noexcept
{
    std::string_view folder = server.programs;
    if (!folder.starts_with('/') || !folder.ends_with(build_folder))
        return {};
    folder.remove_suffix(build_folder.size());
    return folder;
}

std::string configuration_path(ServerCommand const& server)
{
    auto const folder = checkout_of(server);
    if (folder.empty() || server.configuration.starts_with('/'))
        return server.configuration;
    return concat(folder, "/", server.configuration);
}

std::string name_of(ServerCommand const& server)
{
    return fs::path(server.configuration).stem().string();
}

Process const* find_server(std::vector<Process> const& processes, Kind kind, std::string_view folder,
                           std::optional<pid_t> noted, uid_t user)
{
    Process const* found = nullptr;
    for (auto const& each : processes) {
        auto const server = parse_server(each.arguments);
        if (!server || server->kind != kind)
            continue;
        bool const is_noted = noted && each.id == *noted;
        if (checkout_of(*server) != folder) {
            if (is_noted && each.is_moved && is_whose(each.user, user))
                return &each;
            continue;
        }
        if (is_noted)
            return &each;
        auto const ours = concat(folder, "/", config_file(kind, name_of(*server)));
        if (!found && is_whose(each.user, user) && configuration_path(*server) == ours)
            found = &each;
    }
    return found;
}

std::optional<std::uint64_t> parse_beginning(std::string_view stat)
{
    constexpr std::size_t beginning =
        19; // after the state, of what follows the name: proc(5) counts it as 22
    auto const name_end = stat.rfind(')'); // the name may hold anything
    if (name_end == std::string_view::npos || name_end + 2 >= stat.size())
        return std::nullopt;
    auto const fields = core::split(core::trim(stat.substr(name_end + 2)), ' ');
    if (fields.size() <= beginning || fields[0] == "Z" || fields[0] == "X")
        return std::nullopt;
    std::uint64_t ticks = 0;
    std::from_chars(fields[beginning].data(), fields[beginning].data() + fields[beginning].size(), ticks);
    return ticks;
}

} // namespace webots_cloud::site
