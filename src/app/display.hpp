// Which display simulators draw on, on this machine.
#pragma once

#include "remarks.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/private_display.hpp>
#include <webots_cloud/sandbox.hpp>

#include "core/simulation/display_choice.hpp"

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::app {

/// What the configuration and the environment say.
core::DisplayChoice wanted_display(SimulationConfig const& config);

struct ChosenDisplay
{
    ChosenDisplay() = default;

    std::string name;        ///< What `DISPLAY` is set to; empty: nothing.
    PrivateDisplay own;      ///< A display for each.
    std::string description; ///< For the monitor page, as in ":0, shared by all".
};

/// Does what the key `display` says, and tries whether it works. `state` is an existing folder of ours.
/// Lifetime: what is passed by reference must outlive the operation.
/// Errors: `start_failed`: private displays, for which the operator has asked, do not work here.
boost::asio::awaitable<result<ChosenDisplay>>
choose_display(SimulationConfig const& config, SandboxParams const& sandbox, std::filesystem::path guard,
               std::filesystem::path state, ProcessHost& processes, Clock& clock, Remarks& remarks);

} // namespace webots_cloud::app
