// Decisions: core/projects/repository_policy, core/access/admission, core/simulation/service_state.
#include "start_rules.hpp"

#include "core/projects/repository_policy.hpp"
#include "core/refusals.hpp"
#include "core/simulation/port_pool.hpp"
#include "core/text.hpp"
#include "stager.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace webots_cloud {

using core::concat;

namespace {

/// Whether worlds of this repository may run here. The projects of websites need no policy: the operator
/// chose them.
result<> check_policy(SessionContext const& context, core::SimulationRequest const& request)
{
    auto const* start = std::get_if<core::StartMessage>(&request);
    if (!start)
        return {};
    auto const forge = context.fetcher.forge_of(start->url);
    if (!forge)
        return forge.error();
    core::ForgeOfWorld const place(forge->address.url, forge->source.get().ref_meaning(),
                                   forge->address.kind);
    if (auto why = core::refusal(context.policy, start->url, place, context.load))
        return std::move(*why);
    return {};
}

} // namespace

bool takes_controllers(SessionContext const& context, core::SimulationRequest const& request)
{
    auto const* start = std::get_if<core::StartMessage>(&request);
    auto const& config = context.config;
    if (!start || config.controller_port == 0 || !context.hooks.new_address_token)
        return false;
    auto const forge = context.fetcher.forge_of(start->url);
    if (!forge)
        return false;
    core::ForgeOfWorld const place(forge->address.url, forge->source.get().ref_meaning(),
                                   forge->address.kind);
    return std::ranges::any_of(config.controller_repositories, [&](std::string const& rule) {
        return core::allows(rule, start->url, place);
    });
}

result<> may_start(SessionContext const& context, core::SimulationRequest const& request)
{
    if (context.state.is_draining())
        return core::refused(core::Refused::server_drains);
    return check_policy(context, request);
}

result<> take_place(SessionContext& context, std::string const& client,
                    core::SimulationRequest const& request, core::Admission::Place& place)
{
    using Verdict = core::Admission::Verdict;
    std::string world; // of a website's projects none
    if (auto const* start = std::get_if<core::StartMessage>(&request)) {
        auto const parsed = context.fetcher.parse(start->url); // of however many links to it
        world = parsed ? parsed->address() : start->url;
    }
    auto& admission = context.admission;
    auto const verdict = admission.admit(client, world, place);
    if (verdict == Verdict::admitted) {
        // A staged simulation may have to go for it.
        context.stager->on_change();
        return {};
    }
    if (verdict == Verdict::world_full)
        return core::refused(core::Refused::world_has_enough,
                             {{"max", std::to_string(admission.simulations_per_world())}});
    if (verdict == Verdict::full)
        return core::too_many_simulations(admission.max_simulations());
    // A proxy that is not trusted makes all of its browsers one client, which only the operator can see and
    // mend.
    auto const& full = admission.full_client();
    auto const max = std::to_string(full.allowed);
    if (verdict == Verdict::client_full_first)
        context.log.warning(LogCause("simulation limit"),
                            concat("More than ", max, " simulations of ", full.key,
                                   " are refused: see \"simulationsPerAddress\", and \"trustedProxies\" if "
                                   "that is a proxy"));
    return core::refused(core::Refused::client_has_enough, {{"count", max}});
}

} // namespace webots_cloud
