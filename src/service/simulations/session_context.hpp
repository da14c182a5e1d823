// What the sessions of a server share: what it was given, the rules that all of them ask, and what is
// counted.
#pragma once

#include "core/access/admission.hpp"
#include "core/projects/repository_policy.hpp"
#include "core/simulation/service_state.hpp"
#include "core/simulation/start_figures.hpp"

#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/simulation_service.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <cstdint>
#include <map>
#include <utility>

namespace webots_cloud {

class Stager;

/// What the sessions of a server share.
struct SessionContext
{
    SessionContext(SimulationServiceConfig const& service_config, SimulationServiceFacts const& service_facts,
                   SimulationServiceHooks const& service_hooks, ProjectFetcher& projects,
                   SimulationLauncher& simulators, Clock& time, Logger logger, core::AdmissionLimits limits)
        : config(service_config), facts(service_facts), hooks(service_hooks), fetcher(projects),
          launcher(simulators), clock(time), log(std::move(logger)), admission(limits)
    {}

    SimulationServiceConfig const& config;
    SimulationServiceFacts const& facts;
    SimulationServiceHooks const& hooks;

    ProjectFetcher& fetcher;
    SimulationLauncher& launcher;
    Clock& clock;
    Logger log;
    core::RepositoryPolicy policy;
    core::ServiceState state;
    Stager* stager = nullptr; ///< Set before there are sessions.
    double load = 0;          ///< Of this machine when it was last measured, in percent.
    double memory = 0;        ///< In use then, in percent, by staged simulations too.
    double cores = 0;         ///< Of this machine; 0: nobody knows.
    core::Admission admission;
    core::StartFigures start_figures;
    core::FetchFigures fetch_figures; ///< For later starts.
    /// How often a simulation got ready, began to wait for its browser, or ended: pages that were made before
    /// that are old.
    std::uint64_t changes = 0;
    std::uint64_t staged_taken = 0;          ///< Staged simulations that browsers got.
    std::map<Limit, std::uint64_t> overruns; ///< Simulations that were ended at a limit.
    /// Bytes of simulations that have ended, from and to browsers.
    std::uint64_t ended_received = 0;
    std::uint64_t ended_sent = 0;
};

} // namespace webots_cloud
