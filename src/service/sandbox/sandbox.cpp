// Decisions: core/sandbox/sandbox_check.
#include <webots_cloud/sandbox.hpp>

#include "confine.hpp"
#include "core/sandbox/sandbox_check.hpp"
#include "core/sandbox/simulation_user.hpp"
#include "core/text.hpp"
#include "run_as.hpp"
#include "service/run_program.hpp"

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr auto test_limit = std::chrono::seconds(15); // of a machine that has much to do

} // namespace

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
    // It can't do what it must not. Whether it can do what it must is another question.
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
