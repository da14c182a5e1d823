// Decisions: core/simulation/private_display.
#include <webots_cloud/private_display.hpp>

#include "confine.hpp"
#include "core/simulation/private_display.hpp"
#include "service/run_program.hpp"

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr auto check_limit = core::display_limit + std::chrono::seconds(10);

} // namespace

asio::awaitable<result<>> check_private_display(ProcessHost& processes, Clock& clock, PrivateDisplay display,
                                                SandboxParams sandbox, std::filesystem::path instance)
{
    ProcessSpec process;
    process.directory = instance;
    give_display(process, display);
    sandbox.network = {}; // which takes time, and changes nothing here
    if (!sandbox.is_none())
        confine(process, sandbox, instance, 0);
    auto const printed = co_await run_program(processes, clock, std::move(process), check_limit);
    if (!printed)
        co_return printed.error();
    co_return result<>();
}

} // namespace webots_cloud
