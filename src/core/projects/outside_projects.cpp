#include "outside_projects.hpp"

#include "core/text.hpp"

#include <vector>

namespace webots_cloud::core {
namespace {

constexpr std::string_view these = "Projects outside of \"allowedRepositories\"";

/// What the sandbox lacks, each as it would be set up.
std::string missing(SimulationWalls const& walls, bool has_list)
{
    std::vector<std::string> parts;
    if (!walls.limits)
        parts.emplace_back("limits for each simulation that hold");
    if (!walls.own_displays)
        parts.emplace_back("\"display\": \"private\"");
    if (!walls.by_name && has_list)
        parts.push_back(concat("\"sandbox\": \"", walls.sandbox, "\" rather than \"auto\""));
    std::string text;
    for (std::size_t i = 0; i < parts.size(); ++i)
        text.append(i == 0 ? "" : i + 1 == parts.size() ? " and " : ", ").append(parts[i]);
    return text;
}

} // namespace

OutsideProjects judge_outside_projects(SimulationWalls const& walls, bool has_list)
{
    OutsideProjects outside;
    if (walls.containers) {
        outside.accepted = true;
        outside.remark = concat(these, " may run here when the machine is idle, in containers.");
        return outside;
    }
    if (walls.sandbox.empty()) {
        outside.remark = concat(these, " are refused: simulations run without a sandbox.");
        return outside;
    }
    outside.needed = missing(walls, has_list);
    if (outside.needed.empty()) {
        outside.accepted = true;
        outside.remark =
            concat(these, " may run here when the machine is idle, in the sandbox ", walls.sandbox, ".");
        return outside;
    }
    outside.remark = concat(these, " are refused. To accept them in the sandbox ", walls.sandbox,
                            " when the machine is idle, this server needs ", outside.needed, ".");
    return outside;
}

} // namespace webots_cloud::core
