// Who runs simulators: another user than the server's, where the server is root.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud {

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
    std::uint32_t user = 0;                     ///< Of `one`.
    std::uint32_t group = 0;                    ///< Of `one`.
    std::vector<std::uint32_t> groups;          ///< Further groups: those of graphics processors above all.
    std::string name;                           ///< What `USER` is set to.
    std::vector<std::filesystem::path> visible; ///< What simulators have to reach: Webots.

    bool is_other() const noexcept { return kind != Kind::servers; }
};

} // namespace webots_cloud
