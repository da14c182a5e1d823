#include "guard_command.hpp"

#include "core/text.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace webots_cloud::adapters {
namespace {

constexpr std::uint64_t file_size_reserve = 1 << 20; // so that such a file is more than all may be
constexpr std::uint64_t process_reserve = 16;        // so that an attempt to have more is noticed

void add_network(std::vector<std::string>& arguments, ProcessNetwork const& network)
{
    using enum ProcessNetwork::Reach;
    if (network.reach == host)
        return;
    auto const port = std::to_string(network.port);
    if (network.reach == none)
        arguments.insert(arguments.end(), {"--network", "none", port});
    else
        arguments.insert(arguments.end(), {"--network", "internet", port, network.slirp.native(),
                                           network.ip.native(), network.rules.native()});
    if (!network.broker.empty())
        arguments.insert(arguments.end(), {"--broker", network.broker.native()});
}

std::string milliseconds(Duration time)
{
    return std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

void add_user(std::vector<std::string>& arguments, std::optional<ProcessUser> const& user)
{
    if (!user)
        return;
    auto groups = std::to_string(user->group);
    for (auto const group : user->groups)
        groups.append(core::concat(",", std::to_string(group)));
    arguments.insert(arguments.end(), {"--user", std::to_string(user->user), groups, user->folder.native(),
                                       user->home.native(), user->x_authority.native()});
    for (auto const& path : user->visible)
        arguments.insert(arguments.end(), {"--visible", path.native()});
}

void add_limits(std::vector<std::string>& arguments, ProcessLimits const& limits,
                ControlGroups::Group const* group)
{
    auto const add = [&arguments](char const* name, std::uint64_t value) {
        if (value > 0)
            arguments.insert(arguments.end(), {"--limit", name, std::to_string(value)});
    };
    if (group)
        for (auto const& folder : group->folders)
            arguments.insert(arguments.end(), {"--group", folder.native()});
    // Address space says nothing about memory: graphics libraries reserve much more than they use. What a
    // process could write counts also before it does, hence twice the limit.
    if (!group || group->memory == 0)
        add("data", 2 * limits.memory);
    if (!group || group->processes == 0)
        add("processes", limits.processes > 0 ? limits.processes + process_reserve : 0);
    add("files", limits.files);
    add("file-size", limits.disk > 0 ? limits.disk + file_size_reserve : 0);
}

/// Has the program started by another guard, which `spec.remote` starts elsewhere. Of the arguments
/// `cleanup_size` are for our own.
void put_elsewhere(std::vector<std::string>& arguments, std::size_t cleanup_size, std::string const& guard,
                   ProcessSpec const& spec)
{
    auto const& remote = spec.remote;
    std::vector<std::string> ours;
    if (!remote.copied.empty())
        ours.insert(ours.end(), {"--send", std::to_string(remote.copied.size())});
    for (auto const& path : remote.copied)
        ours.push_back(path.native());
    ours.push_back(milliseconds(spec.grace));
    ours.insert(ours.end(), remote.command.begin(), remote.command.end());
    ours.insert(ours.end(),
                {guard, "--job", std::to_string(remote.first_port), std::to_string(remote.last_port)});
    if (!remote.copied.empty())
        ours.insert(ours.end(), {"--receive", remote.copied_to.native(), spec.directory.native()});
    arguments.insert(arguments.begin() + static_cast<std::ptrdiff_t>(cleanup_size), ours.begin(), ours.end());
}

} // namespace

std::vector<std::string> guard_arguments(ProcessSpec const& spec, std::string const& guard,
                                         std::vector<std::string> const& read_only,
                                         ControlGroups::Group const* group)
{
    std::vector<std::string> arguments;
    if (!spec.cleanup_command.empty()) {
        arguments.emplace_back("--cleanup");
        arguments.push_back(std::to_string(spec.cleanup_command.size()));
        arguments.insert(arguments.end(), spec.cleanup_command.begin(), spec.cleanup_command.end());
    }
    // What comes before this is for our own guard, also where the program is started elsewhere.
    auto const cleanup_size = arguments.size();
    if (spec.user && spec.user->user_namespace >= 0)
        arguments.emplace_back("--subordinate");
    if (spec.set_user_id)
        arguments.emplace_back("--set-user-id");
    add_network(arguments, spec.network);
    add_limits(arguments, spec.limits, group);
    if (!spec.container.docker.empty())
        arguments.insert(arguments.end(),
                         {"--container", spec.container.docker.native(), spec.container.label});
    if (!spec.own_sandbox.empty())
        arguments.insert(arguments.end(), {"--own-sandbox", spec.own_sandbox.native()});
    if (spec.own_displays)
        arguments.emplace_back("--own-displays");
    int descriptor = ProcessSpec::first_opened;
    for (auto const& file : spec.opened)
        arguments.insert(arguments.end(), {"--open", std::to_string(descriptor++), file.native()});
    add_user(arguments, spec.user);
    for (auto const& folder : read_only)
        arguments.insert(arguments.end(), {"--read-only", folder});
    arguments.push_back(milliseconds(spec.grace));
    arguments.insert(arguments.end(), spec.argv.begin(), spec.argv.end());
    if (!spec.remote.command.empty())
        put_elsewhere(arguments, cleanup_size, guard, spec);
    return arguments;
}

} // namespace webots_cloud::adapters
