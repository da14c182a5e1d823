// The user that runs simulators: another user than the server's, where the server is root, or has subordinate
// numbers.
#pragma once

#include <webots_cloud/export.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Numbers that `/etc/subuid` and `/etc/subgid` leave to a user.
struct SubordinateRange
{
    SubordinateRange() = default;

    std::filesystem::path newuidmap; ///< The programs that may use them, absolute.
    std::filesystem::path newgidmap;
    std::uint32_t first_user = 0;
    std::uint32_t first_group = 0;
    std::uint32_t count = 0; ///< Of both; at least 65536.
};

/// The user of simulators.
struct SimulationUser
{
    SimulationUser() = default;

    enum class Kind
    {
        servers,   ///< The server's own user.
        one,       ///< One user for all of them.
        of_its_own ///< Each simulation has a user number that nobody else on this machine has.
    };

    Kind kind = Kind::servers;
    int user_namespace = -1;                    ///< Of `of_its_own`: where the numbers are meant; -1: here.
    std::uint32_t numbers = 0;                  ///< Of `of_its_own`, in a namespace: 1 to this.
    std::uint32_t user = 0;                     ///< Of `one`.
    std::uint32_t group = 0;                    ///< Of `one`.
    std::vector<std::uint32_t> groups;          ///< Further groups: those of graphics processors above all.
    std::string name;                           ///< What `USER` is set to.
    std::vector<std::filesystem::path> visible; ///< What simulators have to reach: Webots.

    bool is_other() const noexcept { return kind != Kind::servers; }
};

} // namespace webots_cloud
