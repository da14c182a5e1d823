#include "private_display.hpp"

namespace webots_cloud::core {

std::vector<std::string> on_private_display(std::filesystem::path const& guard,
                                            std::filesystem::path const& server,
                                            std::vector<std::string> const& argv)
{
    auto const limit = std::chrono::duration_cast<std::chrono::milliseconds>(display_limit).count();
    std::vector<std::string> command{guard.native(), "--display", server.native(), std::to_string(limit)};
    command.insert(command.end(), argv.begin(), argv.end());
    return command;
}

bool says_display_has_ended(std::string_view line) noexcept
{
    return line.starts_with("display has ended: "); // src/guard/display.cpp
}

} // namespace webots_cloud::core
