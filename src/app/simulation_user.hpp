// Which user simulations run as on this machine.
#pragma once

#include "adapters/process/subordinate_users.hpp"
#include "adapters/projects/instance_root.hpp"
#include "sandbox.hpp"

#include <webots_cloud/simulation_user.hpp>

#include <memory>
#include <string>

namespace webots_cloud::app {

struct ChosenUser
{
    ChosenUser() = default;

    SimulationUser user;
    std::shared_ptr<adapters::SubordinateUsers> subordinate; ///< Whose namespace `user` means; null: none.
    bool is_elsewhere = false; ///< Simulations are in containers or jobs, which have users of their own.
    std::string problem; ///< Why no other user can be had; empty: one has been, or nobody asked for one.
};

/// Does what the key `simulationUser` says, and tries whether it works: the user must reach Webots, and be
/// kept from the server. Where nobody asked for a user and it does not work, simulations run as the server's,
/// with a warning where that is root.
/// Lifetime: all but `context` must outlive the operation.
/// Errors: `start_failed`: the user that the operator asked for can't be had.
boost::asio::awaitable<result<ChosenUser>> choose_simulation_user(SimulationConfig const& config,
                                                                  SandboxContext context,
                                                                  ProcessHost& processes, Clock& clock,
                                                                  Remarks& remarks);

/// Removes what simulations of an earlier server have left, with the rights of the users whose it is: before
/// the service starts. `subordinate`: null: they are tried. What can't be removed is told the operator.
/// Lifetime: `root` must outlive the operation.
boost::asio::awaitable<void> remove_left_overs(adapters::InstanceRoot& root,
                                               std::shared_ptr<adapters::SubordinateUsers> subordinate,
                                               std::filesystem::path guard, Logger log);

/// For the monitor page: who runs simulations, `chosen` or, since the sandbox did not work so, another
/// `user`.
std::string describe_user(ChosenUser const& chosen, SimulationUser const& user);

/// What simulations that share this server's user may do to it, as `core::shared_user_risk` says; empty:
/// nothing.
std::string_view shared_user_risk(ChosenUser const& chosen, SimulationUser const& user);

/// Who runs simulations, as `describe_user` says; and what that means, where it is the server's user.
void remark_on_user(ChosenUser const& chosen, SimulationUser const& user, Remarks& remarks);

} // namespace webots_cloud::app
