#include "simulator_choice.hpp"

#include "core/text.hpp"

#include <array>

namespace webots_cloud::core {

namespace fs = std::filesystem;

namespace {

constexpr std::array<char const*, 2> usual_programs = {"/usr/local/webots/webots", "/usr/bin/webots"};

} // namespace

result<> check_webots_home(fs::path const& configured_home, fs::path const& environment_home,
                           IsProgram const& is_program)
{
    bool const is_configured = !configured_home.empty();
    auto const& home = is_configured ? configured_home : environment_home;
    if (home.empty() || is_program(home / "webots"))
        return {};
    return Failure(errc::invalid_config,
                   concat((home / "webots").string(),
                          " is missing or not executable. Name the folder of Webots that has it, or ",
                          is_configured ? "remove the key" : "unset it",
                          ": then Webots is looked for in its usual places"));
}

result<SimulatorChoice> choose_simulator(fs::path const& configured_home, fs::path const& environment_home,
                                         fs::path const& our_programs, IsProgram const& is_program)
{
    if (auto const checked = check_webots_home(configured_home, environment_home, is_program); !checked)
        return checked.error().within(configured_home.empty() ? webots_home_variable : "key \"webotsHome\"");
    SimulatorChoice choice;
    if (auto const& home = configured_home.empty() ? environment_home : configured_home; !home.empty()) {
        choice.program = home / "webots";
        choice.home = home;
        return choice;
    }
    std::string looked_at;
    for (auto const* const candidate : usual_programs) {
        choice.program = candidate;
        choice.home = choice.program.parent_path();
        if (is_program(choice.program))
            return choice;
        looked_at += concat(looked_at.empty() ? "" : ", ", candidate);
    }
    choice.program = our_programs / "webots-demo-simulator";
    choice.home = our_programs.parent_path() / "share/webots_cloud/demo_simulator";
    if (!is_program(choice.program))
        return Failure(errc::not_found,
                       concat("no Webots found at ", looked_at, ", and no demo simulator at ",
                              choice.program.string(), ". Set \"webotsHome\" or WEBOTS_HOME."));
    choice.notice = concat(
        "No Webots is installed (looked at ", looked_at,
        "): this server runs the demo simulator, which shows a few robots in an arena and is not Webots.");
    return choice;
}

} // namespace webots_cloud::core
