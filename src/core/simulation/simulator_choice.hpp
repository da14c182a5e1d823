// Which simulator a server runs: Webots where it is installed, the demo simulator otherwise.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <functional>
#include <string>

namespace webots_cloud::core {

struct SimulatorChoice
{
    SimulatorChoice() = default;

    std::filesystem::path program; ///< Absolute.
    std::string notice;            ///< Not empty when it is not Webots, or not the Webots that was named.
};

/// Looks for Webots in the configured home, in `WEBOTS_HOME` and where its packages put it, and then for
/// `webots-demo-simulator` among our own programs.
///
/// `is_program` tells whether a path can be run.   Errors: `not_found`, saying where was looked.
result<SimulatorChoice> choose_simulator(std::filesystem::path const& configured_home,
                                         std::filesystem::path const& environment_home,
                                         std::filesystem::path const& our_programs,
                                         std::function<bool(std::filesystem::path const&)> const& is_program);

} // namespace webots_cloud::core
