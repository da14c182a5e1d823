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

/// Where no sandbox has folders for these.
void name_folders(core::Environment& environment, std::filesystem::path const& home)
{
    std::erase_if(environment, [](auto const& variable) {
        return std::find(servers_folders.begin(), servers_folders.end(), variable.first) !=
               servers_folders.end();
    });
    core::set_variable(environment, "HOME", home.native());
    core::set_variable(environment, "TMPDIR", "/tmp");
}

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
        process.set_user_id = false; // set-user-ID programs don't work in there
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

    // The variables of our own user would lead it to folders that it can't enter.
    auto& environment = process.environment;
    for (auto const* const name : {"USER", "LOGNAME"})
        core::set_variable(environment, name, wanted.name);
    if (sandbox.is_none())
        name_folders(environment, user.home);
    // The password of the display is in a file that is ours alone: this user gets a copy in its home.
    if (!core::value_of(environment, "DISPLAY").empty()) {
        user.x_authority = core::value_of(environment, "XAUTHORITY");
        if (user.x_authority.empty())
            user.x_authority = sandbox.x_authority;
    }
    if (!user.x_authority.empty())
        core::set_variable(environment, "XAUTHORITY", (user.home / "Xauthority").native());
    process.user = std::move(user);
}

void run_beside(ProcessSpec& process, SandboxParams const& sandbox, ProcessUser owner,
                std::filesystem::path const& instance)
{
    if (sandbox.is_none())
        name_folders(process.environment, owner.home);
    if (owner.user_namespace >= 0)
        process.set_user_id = false;
    process.directory.clear(); // we may not enter it
    owner.visible.push_back(instance);
    owner.folder.clear(); // nothing changes hands: programs that run could put links in the way
    owner.home.clear();
    owner.x_authority.clear();
    process.user = std::move(owner);
}

} // namespace webots_cloud
