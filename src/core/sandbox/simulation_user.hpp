// Which user simulations run as, from what the operator wants and what the server may do.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/simulation_user.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// A user that simulations get if there is one with this name, and nothing else is configured.
inline constexpr std::string_view usual_simulation_user = "webots-simulation";

/// A user of this machine.
struct KnownUser
{
    KnownUser() = default;

    std::string name;
    std::uint32_t user = 0;
    std::uint32_t group = 0;
    std::vector<std::uint32_t> groups;
};

/// What the choice depends on.
struct SimulationUserContext
{
    SimulationUserContext() = default;

    std::string_view configured;    ///< `simulationUser`
    std::uint32_t server = 0;       ///< The number of the server's own user.
    std::uint64_t capabilities = 0; ///< Those that the server has, as `CapEff` of `/proc/self/status`.
    std::optional<KnownUser> named; ///< The user with the configured name, or else with the usual one.
};

/// Errors: `invalid_config`: the operator asks for a user that simulations can't have; `unavailable`: nobody
/// asked, but the server is root and lacks a capability, so that simulations would run as root. The detail is
/// a sentence without its end, as in "it lacks the capability CAP_SETUID".
result<SimulationUser> choose_simulation_user(SimulationUserContext const& context);

/// The number of a user for the simulation on this port: one that no user of the machine has, nor a container
/// of systemd's or of those that share `/etc/subuid`, nor another simulation that runs now. Consecutive
/// `turn`s give different numbers, so that a simulation does not own what an earlier one has left.
std::uint32_t own_user_number(std::uint64_t turn, std::uint16_t port);

/// The same for a simulation of this user; in a user namespace, one of the namespace's numbers.
std::uint32_t own_user_number(SimulationUser const& user, std::uint64_t turn, std::uint16_t port);

/// What simulations that share the server's user may do to it; empty: they are other users. A sentence
/// without its subject, which is "each of them".
std::string_view shared_user_risk(SimulationUser const& user);

/// `CapEff` of the text of `/proc/self/status`; 0: there is none.
std::uint64_t effective_capabilities(std::string_view status);

} // namespace webots_cloud::core
