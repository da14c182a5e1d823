#include "simulator_choice.hpp"

#include "core/text.hpp"

#include <vector>

namespace webots_cloud::core {

namespace fs = std::filesystem;

result<SimulatorChoice> choose_simulator(fs::path const& configured_home, fs::path const& environment_home,
                                         fs::path const& our_programs,
                                         std::function<bool(fs::path const&)> const& is_program)
{
    bool const named = !configured_home.empty() || !environment_home.empty();
    std::vector<fs::path> candidates;
    if (!configured_home.empty())
        candidates.push_back(configured_home / "webots");
    if (!environment_home.empty())
        candidates.push_back(environment_home / "webots");
    candidates.emplace_back("/usr/local/webots/webots");
    candidates.emplace_back("/usr/bin/webots");

    SimulatorChoice choice;
    std::string looked_at;
    for (auto const& candidate : candidates) {
        if (is_program(candidate)) {
            choice.program = candidate;
            if (named && candidate != candidates.front())
                choice.notice = concat("There is no Webots at ", candidates.front().string(), ": running ",
                                       candidate.string(), ".");
            return choice;
        }
        looked_at += concat(looked_at.empty() ? "" : ", ", candidate.string());
    }
    choice.program = our_programs / "webots-demo-simulator";
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
