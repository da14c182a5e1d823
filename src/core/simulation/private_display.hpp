// A display of its own for each simulator: what is started, and what is said when it ends too early.
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// How long the X server may take until it is ready, on a machine that has much to do.
inline constexpr auto display_limit = std::chrono::seconds(30);

/// The command line of the guard that runs `argv` on a display of `server`, Xvfb. Without one it waits until
/// the display is ready.
std::vector<std::string> on_private_display(std::filesystem::path const& guard,
                                            std::filesystem::path const& server,
                                            std::vector<std::string> const& argv);

/// Whether it is the guard's line about an X server that has ended before its simulator.
bool says_display_has_ended(std::string_view line) noexcept;

} // namespace webots_cloud::core
