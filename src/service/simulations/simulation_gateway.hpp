// How a simulation that is ready is reached: by browsers, through this server or at a port of its own, and by
// controllers of its robots that run elsewhere. Whoever knows its tokens gets in.
#pragma once

#include "core/access/controller_address.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/gateway_address.hpp"
#include "session_context.hpp"

#include <webots_cloud/public_address.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/controllers.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/tunnel_group.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace webots_cloud {

/// Lifetime: the context must outlive it.
class SimulationGateway
{
public:
    explicit SimulationGateway(SessionContext& context) : context_(context) {}

    /// Where its browser has asked for this server, and where it reaches us through a session server
    /// (`public_address_header`), if it does.
    void set_asked(AskedAddress asked, std::string public_base);

    /// The simulation is ready. `request`: which started it. `has_editor`: at a port above its own, for
    /// which Docker opens one of the machine.
    void open(SimulationReady const& ready, core::SimulationRequest const& request, bool has_editor);

    /// Sends its browser where the simulation is.
    void send_address(Channel& channel) const;

    /// Sends its browser where controllers of its robots connect.
    void tell_controllers(Channel& channel) const;

    /// A robot waits for its controller: its author is told where that connects, once there is such a place.
    void note_extern_robot(std::string robot, Channel& channel);

    /// Whether this is the token in the address of the running simulation.
    bool is_at(std::string_view address_token) const noexcept
    {
        return !address_token_.empty() && address_token_ == address_token;
    }

    /// Whether that is a port of the simulation, which is ready, or of its editor.
    bool has_port(std::uint16_t port) const noexcept;

    /// Whether one of them, `port`, is that of its editor.
    bool is_editors(std::uint16_t port) const noexcept { return port != ready_.port; }

    /// What such a request is passed on to.
    ///
    /// Precondition: the simulation has the port.
    Forward forward(core::GatewayPath const& path, IncomingRequest const& request) const;

    /// Whether this is the key for controllers of its robots.
    bool has_controller_key(std::string_view key) const noexcept
    {
        return !controller_key_.empty() && controller_key_ == key;
    }

    /// Where a controller of `robot`, as it calls it, is passed on to.
    ///
    /// Precondition: it has a controller key.
    ControllerWay way_of_controller(std::string_view robot) const;

    /// The simulator itself, which is ready.
    Upstream simulator() const;

    /// Browsers reach it through us.
    bool is_passed_on() const noexcept { return !address_token_.empty(); }

    /// Takes over the limit of the context.
    void limit_traffic();

    /// Null: it is not reached through us.
    TunnelGroup const* tunnels() const noexcept { return tunnels_.get(); }

    /// Cuts off whoever is still connected, and lets nobody in any more.
    void close();

    /// As `close`, once browsers have closed their connections, for those who watch a page that quits. The
    /// simulator takes a connection that is cut off for a failure, and says so, unless its own close frame
    /// comes back: so neither the tunnels nor the simulator end before, but after half a second, as others
    /// may be watching.
    boost::asio::awaitable<void> close_after_goodbyes();

private:
    void forget_keys();
    std::string reached_at() const;
    void tell_controller(std::size_t robot, Channel& channel) const;

    SessionContext& context_;
    AskedAddress asked_;
    std::string public_base_;
    SimulationReady ready_; ///< Where the simulator listens, once it does.
    bool has_editor_ = false;
    std::string address_token_; ///< In its address; empty: nobody reaches it through us.
    std::shared_ptr<TunnelGroup> tunnels_;
    /// With which controllers on other machines are let in; empty: none is. Not the token of the address,
    /// which opens the whole simulation: this one crosses networks as plain text.
    std::string controller_key_;
    core::ExternRobots extern_robots_;
};

} // namespace webots_cloud
