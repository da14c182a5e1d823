// What is asked before a simulation starts, and before anything is fetched (docs/recipes.md, "A rule about
// worlds").
#pragma once

#include "core/access/admission.hpp"
#include "core/simulation/client_protocol.hpp"
#include "session_context.hpp"

#include <webots_cloud/error.hpp>

#include <string>

namespace webots_cloud {

/// Whether this machine takes the simulation, if it has a place for it.
result<> may_start(SessionContext const& context, core::SimulationRequest const& request);

/// Takes a place, if the machine has room for one more simulation, and the world and the client may have
/// another one. `client`: `ChannelInfo::quota_key`. Asked before a project is fetched, also where that is all
/// that is asked for, and where a browser would get a staged simulation; whoever asks gives `place` back.
result<> take_place(SessionContext& context, std::string const& client,
                    core::SimulationRequest const& request, core::Admission::Place& place);

/// Whether its robots may be controlled from other machines. Websites' projects run with Webots R2021b or
/// older, which knows no such controllers.
bool takes_controllers(SessionContext const& context, core::SimulationRequest const& request);

} // namespace webots_cloud
