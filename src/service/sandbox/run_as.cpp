// Decisions: core/simulation/simulator_environment.
#include "run_as.hpp"

#include "core/simulation/simulator_environment.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace webots_cloud {
namespace {

// Folders of the server's user.
constexpr auto servers_folders = std::to_array<std::string_view>(
    {"XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_RUNTIME_DIR", "XDG_STATE_HOME"});

constexpr std::string_view name_of_home = ".webots_cloud-home";

} // namespace

void run_as(ProcessSpec& process, SandboxParams const& sandbox, std::uint32_t number,
            std::filesystem::path const& instance)
{
    auto const& wanted = sandbox.user;
    if (!wanted.is_other())
        return;
    bool const of_its_own = wanted.kind == SimulationUser::Kind::of_its_own;
    ProcessUser user;
    user.user_namespace = wanted.user_namespace;
    if (user.user_namespace >= 0)
        process.set_user_id = false; // nothing of that kind works in there
    user.user = of_its_own ? number : wanted.user;
    user.group = of_its_own ? number : wanted.group;
    user.groups = wanted.groups;
    user.folder = instance;
    user.home = instance / name_of_home;
    user.visible = wanted.visible;
    user.visible.insert(user.visible.end(), sandbox.read_only.begin(), sandbox.read_only.end());
    if (!sandbox.resolver.empty())
        user.visible.push_back(sandbox.resolver);

    if (!sandbox.filter.empty()) // the guard
        user.visible.push_back(sandbox.filter);
    if (process.own_displays) // it begins with the guard, too
        user.visible.emplace_back(process.argv.front());

    auto& environment = process.environment;
    for (auto const* const name : {"USER", "LOGNAME"})
        core::set_variable(environment, name, wanted.name);
    if (sandbox.is_none()) { // else the sandbox has folders for these
        std::erase_if(environment, [](auto const& variable) {
            return std::find(servers_folders.begin(), servers_folders.end(), variable.first) !=
                   servers_folders.end();
        });
        core::set_variable(environment, "HOME", user.home.native());
        core::set_variable(environment, "TMPDIR", "/tmp");
    }
    if (!core::value_of(environment, "DISPLAY").empty()) {
        user.x_authority = core::value_of(environment, "XAUTHORITY");
        if (user.x_authority.empty())
            user.x_authority = sandbox.x_authority;
    }
    if (!user.x_authority.empty())
        core::set_variable(environment, "XAUTHORITY", (user.home / "Xauthority").native());
    process.user = std::move(user);
}

} // namespace webots_cloud
