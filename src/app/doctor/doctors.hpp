// What the doctors of both servers look at, in these servers and in programs of their own.
#pragma once

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

/// The simulator and the graphics processor; nothing where simulations are in containers.
core::Findings simulator_findings(SimulationConfig const& config,
                                  result<core::SimulatorChoice> const& choice);

/// `walls`: what is among the findings without being looked at again. For the server itself that is all that
/// it has tried when it started (`MachineTrial`); other programs try it as well.
CheckWork examine_simulation_server(SimulationConfig config, std::filesystem::path programs,
                                    core::Findings walls, Viewpoint viewpoint,
                                    boost::asio::any_io_executor executor, Progress progress = {});

} // namespace webots_cloud::app
