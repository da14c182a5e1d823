// The servers of a site: what they are called, and where their files are.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::site {

enum class Kind : std::uint8_t
{
    website_host,
    simulation,
    session
};
inline constexpr std::array start_order{Kind::website_host, Kind::simulation, Kind::session};
inline constexpr std::array stop_order{Kind::session, Kind::simulation, Kind::website_host};
inline constexpr std::array status_order{Kind::simulation, Kind::session, Kind::website_host};

/// Its folder in `config` and in `log`.
std::string_view word_of(Kind kind) noexcept;
std::string_view program_of(Kind kind) noexcept;
/// What people call it.
std::string_view called(Kind kind) noexcept;

/// In the folder of the site, as `config/session/local.json`.
std::string config_file(Kind kind, std::string_view name);
/// As `log/.session.pid`.
std::string pid_file(Kind kind);

} // namespace webots_cloud::site
