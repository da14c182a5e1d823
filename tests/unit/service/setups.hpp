// What the parts of a simulation server are made with: settings, and what is found out at the start.
#pragma once

#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/simulation_service.hpp>

namespace webots_cloud {

struct LauncherSetup
{
    SimulationLauncherConfig config;
    SimulationLauncherFacts facts;
};

struct ServiceSetup
{
    SimulationServiceConfig config;
    SimulationServiceFacts facts;
};

} // namespace webots_cloud
