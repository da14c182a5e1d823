// Decisions: core/sandbox/bubblewrap, core/sandbox/firejail, core/simulation/private_display.
#include "confine.hpp"

#include "core/sandbox/bubblewrap.hpp"
#include "core/sandbox/firejail.hpp"
#include "core/simulation/private_display.hpp"
#include "core/simulation/simulator_environment.hpp"

#include <cassert>

namespace webots_cloud {

void confine(ProcessSpec& process, SandboxParams const& sandbox, std::filesystem::path const& instance,
             std::uint16_t port)
{
    assert(!sandbox.is_none());
    core::Visible visible;
    visible.instance = instance;
    visible.directory = process.directory;
    visible.read_only = sandbox.read_only;
    visible.devices = sandbox.devices;
    visible.display = core::value_of(process.environment, "DISPLAY");
    if (!visible.display.empty())
        visible.x_authority = sandbox.x_authority;
    visible.resolver = sandbox.resolver;
    if (process.own_displays) { // its folder for temporary files has those of displays
        visible.own_displays = true;
        visible.read_only.emplace_back(process.argv.front());
        process.own_displays = !sandbox.firejail.empty(); // which can't make the folder itself
    }
    // Innermost, so that it holds for the simulator alone: whoever makes the sandbox needs system calls that
    // it forbids.
    if (!sandbox.filter.empty()) {
        visible.read_only.push_back(sandbox.filter);
        process.argv.insert(process.argv.begin(), {sandbox.filter.native(), "--filter"});
    }
    if (sandbox.firejail.empty()) {
        visible.system_links = sandbox.system_links;
        visible.copied = sandbox.copied;
        visible.first_copied = ProcessSpec::first_opened;
        process.opened = sandbox.copied;
        process.argv = core::bubblewrap_command(sandbox.bubblewrap, visible, process.argv);
        core::set_variable(process.environment, "HOME", core::sandbox_home);
        core::set_variable(process.environment, "XDG_RUNTIME_DIR", core::sandbox_runtime);
    } else {
        process.argv =
            core::firejail_command(sandbox.firejail, sandbox.firejail_profile, visible, process.argv);
        process.own_sandbox = core::firejail_files;
        core::set_variable(process.environment, "HOME", core::sandbox_temporary);
        core::remove_variable(process.environment, "XDG_RUNTIME_DIR"); // there is none in there
    }
    process.network = sandbox.network;
    process.network.port = port;
    process.set_user_id = false; // set-user-ID programs don't work in there
    core::set_variable(process.environment, "TMPDIR", core::sandbox_temporary);
    for (auto const* folder : {"XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME"})
        core::remove_variable(process.environment, folder); // the server's; without them they are in HOME
    if (!sandbox.x_authority.empty() && !visible.display.empty())
        core::set_variable(process.environment, "XAUTHORITY", sandbox.x_authority.native());
}

void give_display(ProcessSpec& process, PrivateDisplay const& display)
{
    assert(!display.server.empty());
    process.argv = core::on_private_display(display.guard, display.server, process.argv);
    process.own_displays = true;
}

} // namespace webots_cloud
