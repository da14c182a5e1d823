// Labels of simulation servers: what a machine can run, in words of its operator.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Of one machine, and of one request.
constexpr std::size_t max_labels = 32;

/// 1 to 40 letters, digits, and `.`, `_`, `-`, `+`.
bool is_label(std::string_view text) noexcept;

/// The release in a `version.txt` of Webots, as in `R2025a`; empty when there is none.
std::string webots_release(std::string_view version_text);

/// What a machine reports: its operator's labels, `docker` in docker mode, and the release of its Webots.
/// In docker mode each world has a Webots of its own.
std::vector<std::string> machine_labels(std::vector<std::string> configured, bool docker,
                                        std::string_view version_text);

} // namespace webots_cloud::core
