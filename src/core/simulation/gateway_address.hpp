// The addresses of simulations that are reached through their server: /simulation/<token>/<port>/...
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The port of a simulation's editor is so far above its own.
inline constexpr int editor_distance = 500;

/// What simulations serve is written by strangers, and what machines serve behind a session server is not the
/// site's; but it has the origin of our pages. So browsers give it an origin of its own, in which it reaches
/// neither them nor what they have stored.
inline constexpr std::string_view sandbox_policy =
    "sandbox allow-scripts allow-forms allow-popups allow-downloads";

/// Editors do not work without their origin: they may be shown in no frame, whose parent they could read.
inline constexpr std::string_view editor_policy = "frame-ancestors 'none'";

/// By this field a session server's gateway tells a machine that it does not trust it
/// (`ServerSpec::trusted`): `sandbox_policy` is added to all that the machine answers, and passwords are left
/// out.
inline constexpr std::string_view untrusted_header = "Webots-Cloud-Untrusted";

/// Where simulators stream pictures: multipart/x-mixed-replace. A WebSocket there gets the same stream in
/// messages, since a browser opens six connections by HTTP to an origin, which is that of all simulations of
/// a site.
inline constexpr std::string_view pictures_path = "/mjpeg";

/// A path below `/simulation/`: views into the path.
struct GatewayPath
{
    std::string_view token;
    std::uint16_t port = 0;
    std::string_view rest; ///< What the simulator is asked for: starts with `/`.
};

/// Reads the path of a request, as it was sent. None: it leads to no simulation.
std::optional<GatewayPath> parse_gateway_path(std::string_view path);

/// Whether a token can be part of an address. Letters only: clients make the address of an editor by adding
/// 500 to the last number of the simulation's address, and replace that number where they first find it.
bool is_gateway_token(std::string_view token) noexcept;

/// What the simulator at `port` is behind: `<host><:|/><server's port>/simulation/<token>/<port>`. `base`:
/// where browsers reach the server, `ws://...` (`public_base`).
std::string gateway_authority(std::string_view base, std::string_view token, std::uint16_t port);

/// `webots:ws(s)://<host><:|/><server's port>/simulation/<token>/<port>`
std::string webots_gateway_message(std::string_view base, std::string_view token, std::uint16_t port);

/// Whether a path lies below `/simulation/`, of this server or, with its port or its own path in front
/// (`/2000/simulation/`, `/machine/abc/simulation/`), of one behind it.
bool is_gateway_path(std::string_view path) noexcept;

/// Pages of monitors that have no origin (`sandbox_policy`) are kept current below this path, by a key.
inline constexpr std::string_view watch_folder = "/monitor/";

/// Whether what follows in a path is a key, so that whoever knows it may use it, from whatever page: below
/// `/simulation/`, as above, or `watch_folder`.
bool is_path_of_key(std::string_view path) noexcept;

/// The beginning of a path that may be shown in logs: up to what follows `/simulation/`, which is a key to a
/// simulation, and to whatever has the length of a key: tickets, wherever in a path they are.
std::string_view without_keys(std::string_view path) noexcept;

} // namespace webots_cloud::core
