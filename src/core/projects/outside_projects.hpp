// Whether projects outside of "allowedRepositories" may run on a machine at all.
#pragma once

#include <webots_cloud/simulation_walls.hpp>

#include <string>

namespace webots_cloud::core {

/// The decision; all else about these projects is the operator's: `RepositoryPolicy`.
struct OutsideProjects
{
    OutsideProjects() = default;

    bool accepted = false;
    std::string needed; ///< Where they are refused: what the sandbox lacks; empty: a lot.
    std::string remark; ///< For the log: a sentence.
};

/// They are accepted in containers, and in a sandbox with limits and displays of their own. An operator who
/// has listed repositories (`has_list`) and left the choice of the sandbox to the server did not ask for
/// strangers: the list alone counts there, so that a new version of the server, or of bubblewrap, does not
/// open it.
OutsideProjects judge_outside_projects(SimulationWalls const& walls, bool has_list);

} // namespace webots_cloud::core
