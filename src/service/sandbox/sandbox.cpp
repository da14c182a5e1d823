// Decisions: core/sandbox/sandbox_check, core/sandbox/bubblewrap, core/sandbox/firejail.
#include <webots_cloud/sandbox.hpp>

#include "confine.hpp"
#include "core/sandbox/bubblewrap.hpp"
#include "core/sandbox/firejail.hpp"
#include "core/sandbox/sandbox_check.hpp"
#include "core/sandbox/simulation_user.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/text.hpp"
#include "run_as.hpp"
#include "service/run_program.hpp"

#include <cassert>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr auto test_limit = std::chrono::seconds(15); // of a machine that has much to do

} // namespace

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
    process.set_user_id = false; // nothing of that kind works in there
    core::set_variable(process.environment, "TMPDIR", core::sandbox_temporary);
    for (auto const* folder : {"XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME"})
        core::remove_variable(process.environment, folder); // the server's; without them they are in HOME
    if (!sandbox.x_authority.empty() && !visible.display.empty())
        core::set_variable(process.environment, "XAUTHORITY", sandbox.x_authority.native());
}

asio::awaitable<result<>> check_sandbox(ProcessHost& processes, Clock& clock, SandboxParams sandbox,
                                        std::filesystem::path instance, SandboxAttempts attempts)
{
    sandbox.read_only.push_back(attempts.guard);
    ProcessSpec process;
    process.argv = core::try_forbidden_things(attempts.guard, attempts.file, attempts.port, attempts.process);
    process.directory = instance;
    confine(process, sandbox, instance, 0);
    run_as(process, sandbox, core::own_user_number(sandbox.user, 0, 0), instance);
    auto const printed = co_await run_program(processes, clock, std::move(process), test_limit);
    if (!printed)
        co_return printed.error();
    co_return core::judge_sandbox(*printed);
}

asio::awaitable<result<>> check_user(ProcessHost& processes, Clock& clock, SandboxParams sandbox,
                                     std::filesystem::path simulator, std::filesystem::path instance,
                                     SandboxAttempts attempts)
{
    auto const number = core::own_user_number(sandbox.user, 0, 0);
    ProcessSpec process;
    process.argv = core::try_forbidden_things(attempts.guard, attempts.file, attempts.port, attempts.process);
    process.directory = instance;
    run_as(process, sandbox, number, instance);
    auto const printed = co_await run_program(processes, clock, std::move(process), test_limit);
    if (!printed)
        co_return printed.error();
    auto judged = core::judge_sandbox(*printed);
    if (!judged)
        co_return judged;
    ProcessSpec test;
    test.argv = {"/usr/bin/test", "-x", simulator.native(), "-a", "-w", instance.native()};
    test.directory = instance;
    run_as(test, sandbox, number, instance);
    test.user->home = instance / "home"; // the other one is there already
    auto const tested = co_await run_program(processes, clock, std::move(test), test_limit);
    if (!tested)
        co_return Failure(tested.error().code(), core::concat("another user can't run ", simulator.native(),
                                                              " or use its own folder ", instance.native()));
    co_return result<>();
}

} // namespace webots_cloud
