// The labels by which containers are told apart.
#pragma once

#include <string_view>

namespace webots_cloud::core {

/// Which of our servers has something made.
inline constexpr std::string_view server_label = "webots_cloud.server";
/// Compose's: of which project a container is.
inline constexpr std::string_view project_label = "com.docker.compose.project";
/// Likewise: of which service.
inline constexpr std::string_view service_label = "com.docker.compose.service";

} // namespace webots_cloud::core
