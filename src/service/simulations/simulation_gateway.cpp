// How one simulation is reached: at a port of its own, or below this server by a token that only its browser
// is told; and where controllers of its robots connect. Once it has ended, nothing leads to it any more.
// Decisions: core/simulation/gateway_address, core/simulation/public_base, core/access/controller_address.
#include "simulation_gateway.hpp"

#include "async/first_of.hpp"
#include "async/wakeup.hpp"
#include "core/access/asked_name.hpp"
#include "core/access/controller_greeting.hpp"
#include "core/simulation/public_base.hpp"
#include "start_rules.hpp"

#include <boost/asio/this_coro.hpp>

#include <optional>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

// For close frames on their way, before what is still connected to a simulation is cut off.
constexpr auto goodbye_time = std::chrono::milliseconds(500);

} // namespace

void SimulationGateway::set_asked(AskedAddress asked, std::string public_base)
{
    asked_ = std::move(asked);
    public_base_ = std::move(public_base);
}

void SimulationGateway::open(SimulationReady const& ready, core::SimulationRequest const& request,
                             bool has_editor)
{
    ready_ = ready;
    has_editor_ = has_editor;
    if (!ready_.through_gateway)
        return;
    address_token_ = context_.hooks.new_address_token();
    if (takes_controllers(context_, request))
        controller_key_ = context_.hooks.new_address_token().substr(0, core::controller_key_length);
    tunnels_ = std::make_shared<TunnelGroup>(context_.config.traffic_limit);
}

void SimulationGateway::send_address(Channel& channel) const
{
    if (ready_.through_gateway) {
        (void)channel.send(core::webots_gateway_message(reached_at(), address_token_, ready_.port));
    } else { // at a port of which no proxy's word about this server says anything
        AskedAddress by_host;
        by_host.host = asked_.host;
        (void)channel.send(
            core::webots_message(core::reached_at(context_.facts.address, by_host), ready_.port));
    }
}

void SimulationGateway::tell_controllers(Channel& channel) const
{
    for (std::size_t robot = 0; robot < extern_robots_.names().size(); ++robot)
        tell_controller(robot, channel);
}

void SimulationGateway::tell_controller(std::size_t robot, Channel& channel) const
{
    auto const& name = extern_robots_.names().at(robot);
    auto const& config = context_.config;
    if (controller_key_.empty()) {
        (void)channel.send(core::no_controller_message(name));
        return;
    }
    auto const place =
        core::controller_place(config.controller_address, reached_at(), config.controller_port);
    auto const url = core::controller_url(place, controller_key_, extern_robots_, robot);
    (void)channel.send(core::controller_message(name, url));
}

/// Where its browser reaches this server, `ws://...`.
std::string SimulationGateway::reached_at() const
{
    return public_base_.empty() ? core::public_base(core::reached_at(context_.facts.address, asked_))
                                : public_base_;
}

void SimulationGateway::note_extern_robot(std::string robot, Channel& channel)
{
    if (extern_robots_.add(std::move(robot)) && !address_token_.empty())
        tell_controller(extern_robots_.names().size() - 1, channel);
}

bool SimulationGateway::has_port(std::uint16_t port) const noexcept
{
    return port == ready_.port || (has_editor_ && port == ready_.port + core::editor_distance);
}

Upstream SimulationGateway::simulator() const
{
    Upstream simulator(ready_.host, ready_.port);
    simulator.broker = ready_.broker;
    return simulator;
}

Forward SimulationGateway::forward(core::GatewayPath const& path, IncomingRequest const& request) const
{
    Forward forward;
    bool const is_editor = is_editors(path.port);
    // An editor is a program of the project at a port of its own; all else is Webots.
    forward.upstream = is_editor ? Upstream("127.0.0.1", path.port) : simulator();
    forward.target = path.rest;
    if (!request.query.empty())
        forward.target.append("?").append(request.query);
    forward.group = tunnels_;
    forward.in_messages = request.upgrade && path.rest == core::pictures_path && !is_editor;
    // What is answered comes from a stranger's project, at the address of this server.
    forward.added_answer_headers.emplace_back("Content-Security-Policy",
                                              is_editor ? core::editor_policy : core::sandbox_policy);
    if (is_editor)
        return forward; // Docker opens that port of the machine for the editor
    // Webots names its own files in what it serves by http:// and this header.
    if (!request.upgrade) {
        auto base = request.is_from_proxy
                        ? core::parse_public_base(request.header(core::public_address_header))
                        : std::nullopt;
        if (!base)
            base = core::public_base(core::reached_at(
                context_.facts.address, core::asked_address(request.headers, request.is_from_proxy)));
        forward.headers.emplace_back("Host", core::gateway_authority(*base, address_token_, ready_.port));
        // Webots says so of files, but not of pictures, which pages read to notice when they grow old.
        forward.answer_headers.emplace_back("Access-Control-Allow-Origin", "*");
    }
    return forward;
}

ControllerWay SimulationGateway::way_of_controller(std::string_view robot) const
{
    ControllerWay way;
    way.upstream = simulator();
    way.asks_for = extern_robots_.resolve(robot);
    way.group = tunnels_;
    return way;
}

void SimulationGateway::limit_traffic()
{
    if (tunnels_)
        tunnels_->set_limit(context_.config.traffic_limit);
}

void SimulationGateway::forget_keys()
{
    address_token_.clear();
    controller_key_.clear();
}

void SimulationGateway::close()
{
    forget_keys();
    if (!tunnels_)
        return;
    tunnels_->close();
    // Counters in /metrics may not fall when a simulation ends.
    context_.ended_received += tunnels_->received();
    context_.ended_sent += tunnels_->sent();
    tunnels_.reset();
}

asio::awaitable<void> SimulationGateway::close_after_goodbyes()
{
    forget_keys();
    if (!tunnels_)
        co_return;
    auto const executor = co_await asio::this_coro::executor;
    auto const emptied = std::make_shared<async::Wakeup>(executor);
    tunnels_->refuse_new([emptied] { emptied->notify(); });
    auto& clock = context_.clock;
    // Browsers close their connections themselves; one that does not is cut off.
    auto parts = async::first_of(emptied->wait(), clock.wait_until(clock.now() + goodbye_time));
    (void)co_await std::move(parts);
    close();
}

} // namespace webots_cloud
