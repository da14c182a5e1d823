// What browsers and controllers ask of machines that they reach through the session server alone.
#pragma once

#include "core/access/forwarding.hpp"
#include "site_context.hpp"

#include <webots_cloud/transport/controllers.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <cstdint>
#include <optional>
#include <string_view>

namespace webots_cloud {

/// Passes it on to them, unread.
///
/// Lifetime: the site must outlive it.   Thread-safety: one executor.
class MachineGateway
{
public:
    explicit MachineGateway(SiteContext const& site) : site_(site) {}

    /// To the machine whose port or path the request's path begins with. Nothing: it is for this server.
    std::optional<Answer> pass_on(IncomingRequest const& request);

    /// As of ControllerDoor.
    result<ControllerWay> way_of_controller(std::uint16_t machine, std::string_view key,
                                            std::string_view robot) const;

    /// The machines of the fleet are others.
    void forget_machines() noexcept { ports_.reset(); }

private:
    core::ForwardingTable const& ports();
    std::optional<Answer> to_port(IncomingRequest const& request);
    std::optional<Answer> to_path(IncomingRequest const& request) const;

    SiteContext const& site_;
    std::optional<core::ForwardingTable> ports_; ///< Of the fleet; nothing: it has changed since.
};

} // namespace webots_cloud
