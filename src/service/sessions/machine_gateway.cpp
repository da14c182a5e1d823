// Decisions: core/access/forwarding, core/access/machine_paths, core/access/controller_greeting.
#include "machine_gateway.hpp"

#include "core/access/controller_greeting.hpp"
#include "core/pages/http_pages.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/simulation/public_base.hpp"
#include "core/text.hpp"

#include <string>
#include <utility>
#include <variant>

namespace webots_cloud {
namespace {

/// What answers there is not ours, but would have the origin of our pages.
Forward to_machine(core::ForwardTarget target)
{
    Forward forward;
    forward.upstream = Upstream(std::move(target.machine.host), target.machine.port);
    forward.upstream.tls = target.machine.tls;
    forward.upstream.name = std::move(target.machine.name);
    forward.upstream.elsewhere = target.is_elsewhere;
    forward.kind = target.kind;
    // A trusted machine says itself which pages are simulations', and which are editors, that need an origin.
    bool const is_behind_its_gateway =
        target.kind != UpstreamKind::simulation && core::is_gateway_path(target.target);
    if (!target.is_trusted || !is_behind_its_gateway)
        forward.added_answer_headers.emplace_back("Content-Security-Policy", core::sandbox_policy);
    if (!target.is_trusted && target.kind != UpstreamKind::simulation)
        forward.headers.emplace_back(core::untrusted_header, "1");
    forward.target = std::move(target.target);
    return forward;
}

} // namespace

std::optional<Answer> MachineGateway::pass_on(IncomingRequest const& request)
{
    if (!site_.config.service.gateway)
        return std::nullopt;
    auto answer = to_port(request);
    // What a machine answers has the site's origin, and would answer for its pages from then on.
    if (answer && std::holds_alternative<Forward>(*answer) && request.header("Service-Worker") == "script")
        return HttpResponse(403, std::string(core::html_type),
                            "Machines can't register service workers for this site.");
    return answer;
}

core::ForwardingTable const& MachineGateway::ports()
{
    if (!ports_) {
        ports_.emplace();
        for (auto const& machine : site_.fleet.machines())
            ports_->add(machine.spec);
    }
    return *ports_;
}

std::optional<Answer> MachineGateway::to_port(IncomingRequest const& request)
{
    auto target = ports().find(request.path, request.query);
    if (!target)
        return to_path(request);
    auto forward = to_machine(std::move(*target));
    if (forward.kind == UpstreamKind::simulation) { // as a simulation server's gateway says of them
        forward.answer_headers.emplace_back("Access-Control-Allow-Origin", "*");
        return forward;
    }
    // A machine with our name knows our port, or our path, from us alone.
    auto const by = asked_by(request);
    if (auto const path = site_.addresses.path_unknown_to_machine(request.path, by); !path.empty())
        forward.headers.emplace_back(core::public_address_header,
                                     core::concat(site_.addresses.own_base(by), path));
    return forward;
}

/// It is called by the name that polls use, which it knows, whatever browsers call us; and its own policy for
/// web pages does not count, since it does not know our name.
std::optional<Answer> MachineGateway::to_path(IncomingRequest const& request) const
{
    auto found = site_.paths.find(request.path, request.query);
    if (!found)
        return std::nullopt;
    if (!found->target)
        return HttpResponse(502, std::string(core::html_type),
                            "The simulation server of this address does not answer. Please start again.");
    auto host = core::authority_of(found->target->machine);
    auto forward = to_machine(std::move(*found->target));
    forward.headers.emplace_back("Host", std::move(host));
    forward.headers.emplace_back("Origin", "");
    forward.headers.emplace_back(core::public_address_header,
                                 core::concat(site_.addresses.own_base(asked_by(request)), found->path));
    return forward;
}

result<ControllerWay> MachineGateway::way_of_controller(std::uint16_t machine, std::string_view key,
                                                        std::string_view robot) const
{
    for (auto const& each : site_.fleet.machines()) {
        auto const place = core::parse_internal_address(each.spec.controllers);
        if (!place || machine == 0 || core::port_of_machine(each.spec.address) != machine)
            continue;
        ControllerWay way;
        way.upstream = Upstream(place->host, place->port);
        way.asks_for = core::controller_path(key, robot);
        return way;
    }
    return Failure(errc::refused,
                   "No machine of this site takes controllers at this address: take the whole one "
                   "that the console of the simulation shows.");
}

} // namespace webots_cloud
