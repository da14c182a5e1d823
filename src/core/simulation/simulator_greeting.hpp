// What the server says to a simulator in place of its page, whose own connection to it takes two round trips.
#pragma once

#include "client_protocol.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Asks for pictures of the page's size, and has the simulation run if the page would do that at once.
///
/// Not `--mode=realtime` on the command line: a staged simulation has none of its own, and Webots prints no
/// line then that says that it runs.
///
/// Pictures must not be fetched before: Webots, by its source of 2023, ends by a fault then.
struct SimulatorGreeting
{
    SimulatorGreeting() = default;

    std::vector<std::string> words;
    std::string last; ///< The answer to the last of them.
    std::string picture_size;
};

/// Nothing: the page shows no pictures, or has not said of what size.
std::optional<SimulatorGreeting> greeting_for(SimulationRequest const& request);

/// Whether the simulator has answered the greeting.
bool is_answered(SimulatorGreeting const& greeting, std::vector<std::string> const& heard);

/// For the page, what the simulator has said to the server and does not say again (`said_message`): lines for
/// the console, and messages of robots. Not more than a session server takes.
std::vector<std::string> said_messages(std::vector<std::string> const& heard);

} // namespace webots_cloud::core
