#include "unit_test.hpp"

#include "core/projects/outside_projects.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(outside_projects)

namespace {

SimulationWalls all_walls()
{
    SimulationWalls walls;
    walls.sandbox = "bubblewrap";
    walls.limits = true;
    walls.own_displays = true;
    return walls;
}

} // namespace

BOOST_AUTO_TEST_CASE(containers_and_a_whole_sandbox_are_enough)
{
    SimulationWalls containers;
    containers.containers = true;
    BOOST_TEST(judge_outside_projects(containers, true).accepted);
    BOOST_TEST(judge_outside_projects(all_walls(), false).accepted);
    BOOST_TEST(
        judge_outside_projects(all_walls(), false).remark ==
        "Projects outside of \"allowedRepositories\" may run here when the machine is idle, in the sandbox "
        "bubblewrap.");
}

BOOST_AUTO_TEST_CASE(without_a_sandbox_browsers_are_told_what_they_always_were)
{
    auto const judged = judge_outside_projects(SimulationWalls(), true);
    BOOST_TEST(!judged.accepted);
    BOOST_TEST(judged.needed == "");
    BOOST_TEST(judged.remark ==
               "Projects outside of \"allowedRepositories\" are refused: simulations run without a sandbox.");
}

BOOST_AUTO_TEST_CASE(a_list_stays_closed_until_the_operator_names_the_sandbox)
{
    auto walls = all_walls();
    auto const judged = judge_outside_projects(walls, true);
    BOOST_TEST(!judged.accepted);
    BOOST_TEST(judged.needed == "\"sandbox\": \"bubblewrap\" rather than \"auto\"");
    walls.by_name = true;
    BOOST_TEST(judge_outside_projects(walls, true).accepted);
}

BOOST_AUTO_TEST_CASE(what_a_sandbox_lacks_is_named)
{
    auto walls = all_walls();
    walls.limits = false;
    BOOST_TEST(!judge_outside_projects(walls, false).accepted);
    walls.own_displays = false;
    BOOST_TEST(judge_outside_projects(walls, false).needed ==
               "limits for each simulation that hold and \"display\": \"private\"");
    BOOST_TEST(judge_outside_projects(walls, true).remark ==
               "Projects outside of \"allowedRepositories\" are refused. To accept them in the sandbox "
               "bubblewrap when "
               "the machine is idle, this server needs limits for each simulation that hold, \"display\": "
               "\"private\" "
               "and \"sandbox\": \"bubblewrap\" rather than \"auto\".");
    walls.limits = true;
    walls.by_name = true;
    BOOST_TEST(!judge_outside_projects(walls, true).accepted);
}

BOOST_AUTO_TEST_SUITE_END()
