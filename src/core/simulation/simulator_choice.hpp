// Which simulator a server runs: Webots where it is installed, the demo simulator otherwise.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

struct SimulatorChoice
{
    SimulatorChoice() = default;

    std::filesystem::path program; ///< Absolute.
    std::filesystem::path home;    ///< What `WEBOTS_HOME` is for makefiles of controllers.
    std::string notice;            ///< Not empty when it is not Webots.
};

/// Tells whether a path can be run.
using IsProgram = std::function<bool(std::filesystem::path const&)>;

/// Who has named a home that no key names.
inline constexpr std::string_view webots_home_variable = "WEBOTS_HOME of the environment";

/// Whether Webots is where the operator says: in the configured home, or else in `WEBOTS_HOME`. Empty ones
/// say nothing. The failure does not say which of the two it was.
///
/// Who names a Webots wants that one: running another, or the demo simulator, would be found out by the
/// browsers. Errors: `invalid_config`.
result<> check_webots_home(std::filesystem::path const& configured_home,
                           std::filesystem::path const& environment_home, IsProgram const& is_program);

/// The Webots of the configured home, or of `WEBOTS_HOME`; without either, the one where its packages put it,
/// and then `webots-demo-simulator` among our own programs.
///
/// Errors: those of `check_webots_home`; `not_found`, saying where was looked.
result<SimulatorChoice> choose_simulator(std::filesystem::path const& configured_home,
                                         std::filesystem::path const& environment_home,
                                         std::filesystem::path const& our_programs,
                                         IsProgram const& is_program);

} // namespace webots_cloud::core
