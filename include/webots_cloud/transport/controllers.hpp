// Controllers of robots that run on other machines: where their connections lead.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/tunnel_group.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Where a controller's connection is passed on to.
struct ControllerWay
{
    ControllerWay() = default;

    Upstream upstream;
    std::string asks_for; ///< The name in the greeting there. Empty: the only robot that waits.
    std::shared_ptr<TunnelGroup> group;
};

/// Knows the simulations whose robots may be controlled from elsewhere, or the machines that do.
///
/// Lifetime: must outlive the adapter that asks it.
/// Thread-safety: called on the adapter's executor only.
class ControllerDoor
{
public:
    virtual ~ControllerDoor() = default;

    /// As the controller has sent them; `machine`: 0, or the port by which a session server knows it; `robot`
    /// may be empty.
    ///
    /// Errors: `refused`, with a sentence that says what to do.
    virtual result<ControllerWay> way_of_controller(std::uint16_t machine, std::string_view key,
                                                    std::string_view robot) = 0;
};

} // namespace webots_cloud
