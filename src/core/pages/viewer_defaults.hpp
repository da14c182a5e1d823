// What the viewer and the page of a class take from the configuration before anybody has typed anything.
#pragma once

#include <webots_cloud/config.hpp>

#include <string>

namespace webots_cloud::core {

/// The answer of `/viewer/defaults.json`, JSON: `url` of the proposed world, `pauseHidden` in seconds, and
/// `waiting` where browsers may wait for a machine. What isn't set is left out.
std::string viewer_defaults(SessionServiceConfig const& config);

} // namespace webots_cloud::core
