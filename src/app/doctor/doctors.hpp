// What the doctors of both servers look at, in these servers and in programs of their own.
#pragma once

#include "app/display.hpp"
#include "app/sandbox.hpp"
#include "app/simulation_user.hpp"
#include "checks.hpp"
#include "core/doctor/finding.hpp"
#include "core/simulation/simulator_choice.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::app {

CheckWork examine_session_server(SessionConfig config, Viewpoint viewpoint,
                                 boost::asio::any_io_executor executor, Progress progress = {});

/// What does not change while a server runs: simulator and graphics processor.
core::Findings wall_findings(SimulationConfig const& config, result<core::SimulatorChoice> const& choice);

/// The same of what the server has tried when it started. `unkept_limits`: as `core::unkept_limits` says.
/// Other programs do not try which limits can be kept: that takes part in control groups.
core::Findings wall_findings(ChosenUser const& user, ChosenSandbox const& sandbox,
                             ChosenDisplay const& display, std::string const& isolation_warning,
                             std::string const& unkept_limits);

/// `walls` are among the findings; other programs than the server try sandbox, user and display as well.
CheckWork examine_simulation_server(SimulationConfig config, std::filesystem::path programs,
                                    core::Findings walls, Viewpoint viewpoint,
                                    boost::asio::any_io_executor executor, Progress progress = {});

} // namespace webots_cloud::app
