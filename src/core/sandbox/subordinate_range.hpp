// Which numbers of users and groups /etc/subuid and /etc/subgid leave to a user.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/simulation_user.hpp>

#include <cstdint>
#include <filesystem>
#include <string_view>

namespace webots_cloud::core {

/// What the search depends on.
struct SubordinateContext
{
    SubordinateContext() = default;

    bool no_new_privs = false;    ///< Set-user-ID programs have no effect.
    std::filesystem::path pinned; ///< Where root would have made users for this service; empty: this is none.
    std::uint32_t user = 0;
    std::string_view name;           ///< Of the user; empty: there is none, which newuidmap needs.
    std::string_view users;          ///< The text of `/etc/subuid`.
    std::string_view groups;         ///< The text of `/etc/subgid`.
    std::filesystem::path newuidmap; ///< Absolute; empty: it is not installed.
    std::filesystem::path newgidmap; ///< The same.
};

/// Takes the first range of each file that is large enough to give each port a number.
/// Errors: `unavailable`: there is none, or it may not be used; the detail says what to install, which line
/// to add to which file, or what the unit of the service is missing.
result<SubordinateRange> find_subordinate_range(SubordinateContext const& context);

} // namespace webots_cloud::core
