// Where controllers on other machines reach the robots of a simulation, and how its author is told
// (protocol section 13.18). Webots prints which robots wait for one (`--extern-urls`).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The robots of a simulation that wait for controllers of others, in the order in which Webots named them.
class ExternRobots
{
public:
    /// Worlds with more are rare, and controllers can print such lines, too.
    static constexpr std::size_t max_robots = 32;

    /// False when it is known already, or there are too many.
    bool add(std::string robot);

    /// What a controller calls a robot, as Webots knows it: by its name, or by `short_name`.
    std::string resolve(std::string_view called) const;

    /// Of the robot at this place: `~1`. For names that would make the address longer than libController
    /// sends.
    static std::string short_name(std::size_t index);

    std::vector<std::string> const& names() const noexcept { return names_; }

private:
    std::vector<std::string> names_;
};

/// The robot, percent-encoded, that Webots names in a line like `tcp://<ip_address>:2001/e-puck`, or
/// `ipc://2001/e-puck` (R2022b).
std::optional<std::string> extern_robot_in(std::string_view line);

/// Where controllers connect: what the operator says (`controllerAddress`), or else the host of `base`,
/// `ws://sim.example.org:2000`, with `port`.
std::string controller_place(std::string_view configured, std::string_view base, std::uint16_t port);

/// `tcp://<place>/<key>/<robot>` of the robot at `index`.
std::string controller_url(std::string_view place, std::string_view key, ExternRobots const& robots,
                           std::size_t index);

} // namespace webots_cloud::core
