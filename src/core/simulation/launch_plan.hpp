// How Webots is started for a world (protocol sections 6.1 and 6.2): the argument vector.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// True for the modes that some Webots knows.
bool is_known_mode(std::string_view mode) noexcept;

/// The browser is sent pictures; in all other modes it draws the scene itself.
constexpr bool is_video(std::string_view mode) noexcept
{
    return mode == "mjpeg";
}

/// How many ports above a busy one Webots tries, without reporting that.
inline constexpr int ports_tried_by_webots = 10;

/// What the `--stream` of R2021b and older takes besides the port.
struct OldStream
{
    OldStream() = default;

    bool picture = false;          ///< Webots sends a picture, instead of a scene that the browser draws.
    bool controller_edit = false;  ///< The browser may edit controllers.
    std::string multimedia_server; ///< Where browsers find the video; empty: there is none.
    std::string multimedia_stream; ///< Where Webots sends it.
    bool ssl = false;              ///< Webots speaks TLS itself, with a certificate of its own.

    bool operator==(OldStream const&) const = default;
};

/// The command line, one argument an element; `world` is absolute.
///
/// The mode in which browsers draw is called `x3d` by Webots up to R2023b and `w3d` by newer ones, and each
/// refuses the other name. So neither is passed on: a bare `--stream` means that mode to all of them, and
/// the Webots that is installed, or in the image, decides.
///
/// `names_extern_robots`: it prints where controllers of others are to connect (R2022b and newer).
std::vector<std::string> webots_command(std::filesystem::path const& webots, std::string_view mode,
                                        std::uint16_t port, std::filesystem::path const& world,
                                        bool names_extern_robots = false);

/// The same for R2021b and older, which browsers that send `init` expect, including its quotes.
std::vector<std::string> old_webots_command(std::filesystem::path const& webots, OldStream const& stream,
                                            std::uint16_t port, std::filesystem::path const& world);

/// Additional needs of R2021b and older: they run controllers, which a website's user may have written, in a
/// sandbox (firejail).
inline constexpr std::pair<char const*, char const*> old_webots_sandbox{"WEBOTS_FIREJAIL_CONTROLLERS", "1"};

} // namespace webots_cloud::core
