#include "display.hpp"

#include "core/text.hpp"
#include "environment.hpp"

#include <boost/asio/error.hpp>

#include <system_error>
#include <utility>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using core::concat;
using Kind = core::DisplayChoice::Kind;

constexpr std::string_view usual_display = ":0";

fs::path find_xvfb()
{
    return find_program("Xvfb");
}

/// Tries a private display.
asio::awaitable<result<>> check(PrivateDisplay const& display, SandboxParams const& sandbox,
                                fs::path const& state, ProcessHost& processes, Clock& clock)
{
    if (display.server.empty())
        co_return Failure(errc::start_failed, "Xvfb is not installed (Debian's package xvfb)");
    auto const instance = state / "display-check";
    std::error_code failed;
    fs::create_directory(instance, failed);
    auto const checked = co_await check_private_display(processes, clock, display, sandbox, instance);
    fs::remove(instance, failed);
    co_return checked;
}

} // namespace

core::DisplayChoice wanted_display(SimulationConfig const& config)
{
    std::error_code failed;
    core::DisplayContext context;
    context.configured = config.display;
    context.display = environment("DISPLAY");
    context.ssh_connection = environment("SSH_CONNECTION");
    context.has_screen = fs::exists("/tmp/.X11-unix/X0", failed);
    context.may_be_private = !config.docker && !find_xvfb().empty();
    return core::choose_display(context);
}

asio::awaitable<result<ChosenDisplay>> choose_display(SimulationConfig const& config,
                                                      SandboxParams const& sandbox, fs::path guard,
                                                      fs::path state, ProcessHost& processes, Clock& clock,
                                                      Remarks& remarks)
{
    ChosenDisplay chosen;
    if (config.docker)
        co_return chosen; // docker mode has parameters of its own
    auto const wanted = wanted_display(config);
    if (wanted.kind == Kind::none) {
        chosen.description = "none";
        remarks.note("Simulations have no display, as \"display\" says: Webots may not start without one.");
        co_return chosen;
    }
    if (wanted.kind == Kind::own) {
        PrivateDisplay own;
        own.server = find_xvfb();
        own.guard = std::move(guard);
        auto const works = co_await check(own, sandbox, state, processes, clock);
        if (works) {
            chosen.own = std::move(own);
            chosen.description = "private (Xvfb)";
            remarks.note(concat("Each simulation has a virtual display of its own (",
                                chosen.own.server.native(), "), which draws without graphics processors."));
            co_return chosen;
        }
        if (works.error().code() == asio::error::operation_aborted)
            co_return works.error();
        // An operator who asks for private displays is not given a shared one instead.
        if (wanted.is_configured)
            co_return Failure(errc::start_failed, concat("\"display\": \"private\" does not work here: ",
                                                         works.error().message(), " (docs/sandboxes.md)"));
        remarks.warn(concat("There is no display, and simulations can't have virtual ones of their own: ",
                            works.error().message(), " (docs/sandboxes.md)."));
    }
    chosen.name = wanted.name.empty() ? std::string(usual_display) : wanted.name;
    chosen.description = concat(chosen.name, ", shared by all");
    remarks.note(concat("All simulations draw on the display ", core::printable(chosen.name, 100), "."));
    co_return chosen;
}

} // namespace webots_cloud::app
