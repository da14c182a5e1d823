// What the viewer and the page of a class take from the configuration before anybody has typed anything.
#pragma once

#include <webots_cloud/config.hpp>

#include <boost/json/object.hpp>

#include <string>

namespace webots_cloud::core {

/// `url` of the proposed world, `pauseHidden` in seconds, and `waiting` where browsers may wait for a
/// machine. What isn't set is left out.
boost::json::object viewer_defaults(SessionServiceConfig const& config);

/// The same as an answer.
std::string viewer_defaults_json(SessionServiceConfig const& config);

} // namespace webots_cloud::core
