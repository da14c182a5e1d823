// What this machine gives simulations, found out by trying: a user, a sandbox, a display and limits. A
// simulation server tries it when it starts and writes the remarks into its log; the doctor tries the same,
// or asks the server that runs, and shows the findings.
#pragma once

#include "core/doctor/finding.hpp"
#include "display.hpp"
#include "remarks.hpp"
#include "sandbox.hpp"
#include "simulation_user.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/simulation_walls.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::app {

struct TrialContext
{
    TrialContext() = default;

    std::filesystem::path simulator; ///< Webots, absolute. Empty: there is none, which leaves little to try.
    std::filesystem::path guard;     ///< `webots-process-guard`, absolute.
    std::filesystem::path state;     ///< An existing folder of ours, for files of the sandbox and of trials.
    std::vector<std::filesystem::path> read_only; ///< Folders that simulations must not change.
    ProcessLimits limits;                         ///< Of each simulation.
    /// Who keeps them. Nothing: it is not known, since finding out takes part in control groups.
    std::optional<LimitSupport> limit_support;
};

struct MachineTrial
{
    MachineTrial() = default;

    ChosenUser user;
    ChosenSandbox sandbox;
    ContainerNetwork container_network; ///< Where simulations are in containers.
    ChosenDisplay display;
    SimulationWalls walls;
    std::string isolation_warning; ///< A sentence, for the monitor page; empty: there is nothing to say.
    std::string unkept_limits;     ///< As `core::unkept_limits` says.
    Remarks remarks;               ///< For the log.
    core::Findings findings;       ///< The same for the doctor.
    /// Errors: those of `choose_simulation_user`, `choose_sandbox` and `choose_display`; what comes after the
    /// one that failed has not been tried.
    result<> outcome;
};

/// Tries one part after the other, as each depends on those before it. Containers have walls of their own:
/// only their network is tried.
///
/// Lifetime: what is passed by reference must outlive the operation.
/// Cancellation: terminal; then `outcome` is `operation_aborted`.
boost::asio::awaitable<MachineTrial> try_machine(SimulationConfig const& config, TrialContext context,
                                                 ProcessHost& processes, Clock& clock);

/// What of the walls around simulations is weaker than the configuration lets people expect: sentences, for
/// the monitor page, `/readyz` and whoever starts the server. Empty: nothing is.
std::string walls_warning(MachineTrial const& trial);

/// How simulations are confined, for the monitor page: sandbox and user.
std::string describe_confinement(MachineTrial const& trial);

} // namespace webots_cloud::app
