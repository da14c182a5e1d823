// The form that a registry of simulation servers is sent (protocol section 11).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// `application/x-www-form-urlencoded`: url, shareIdleTime and the comma-joined allowedRepositories.
std::string registration_form(std::string_view url, double share_idle_time,
                              std::vector<std::string> const& allowed);

} // namespace webots_cloud::core
