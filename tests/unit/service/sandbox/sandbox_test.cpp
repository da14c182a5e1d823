#include "unit_test.hpp"

#include <webots_cloud/sandbox.hpp>
#include <webots_cloud/testing/scripted_processes.hpp>
#include <webots_cloud/testing/world.hpp>

#include <filesystem>
#include <string>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(sandbox)

namespace {

struct SandboxFixture
{
    SandboxFixture()
    {
        sandbox.bubblewrap = "/usr/bin/bwrap";
        attempts.guard = "/opt/guard";
        attempts.file = "/state/secret";
        attempts.port = 2000;
        attempts.process = 42;
    }

    ~SandboxFixture() { BOOST_TEST(processes.alive() == 0); }

    result<> checked()
    {
        return world.run(check_sandbox(processes, world.clock, sandbox, "/instances/1", attempts));
    }

    testing::World world;
    testing::ScriptedProcesses processes{world.clock};
    SandboxParams sandbox;
    SandboxAttempts attempts;
};

} // namespace

BOOST_FIXTURE_TEST_CASE(what_must_fail_in_a_sandbox_is_tried_in_it, SandboxFixture)
{
    processes.expect().prints("tried\n").exits(0);
    BOOST_TEST(checked().has_value());
    auto const& process = processes.started().front();
    BOOST_TEST(process.argv.front() == "/usr/bin/bwrap");
    BOOST_TEST_REQUIRE(process.argv.size() > 5u);
    BOOST_TEST((std::vector(process.argv.end() - 5, process.argv.end()) ==
                std::vector<std::string>{"/opt/guard", "--try", "/state/secret", "2000", "42"}));
    BOOST_TEST(process.directory == "/instances/1");
}

BOOST_FIXTURE_TEST_CASE(a_sandbox_that_lets_something_through_is_refused, SandboxFixture)
{
    processes.expect().prints("tried file\n").exits(0);
    BOOST_TEST((checked().error().code() == errc::refused));
}

BOOST_FIXTURE_TEST_CASE(a_sandbox_that_can_not_be_made_says_why, SandboxFixture)
{
    processes.expect().prints("bwrap: No permissions\n").exits(1);
    auto const error = checked().error();
    BOOST_TEST((error.code() == errc::start_failed));
    BOOST_TEST(error.message().find("bwrap: No permissions") != std::string::npos, error.message());
}

BOOST_FIXTURE_TEST_CASE(a_sandbox_in_which_nothing_ends_is_given_up_after_15_seconds, SandboxFixture)
{
    processes.expect();
    auto const begin = world.clock.now();
    BOOST_TEST((checked().error().code() == errc::timed_out));
    BOOST_TEST((world.clock.now() - begin == 15s));
}

BOOST_FIXTURE_TEST_CASE(a_user_who_can_not_run_the_simulator_is_refused, SandboxFixture)
{
    sandbox.bubblewrap.clear();
    sandbox.user.kind = SimulationUser::Kind::of_its_own;
    processes.expect().prints("tried\n").exits(0);
    processes.expect().exits(1);
    auto const checked =
        world.run(check_user(processes, world.clock, sandbox, "/opt/webots", "/instances/1", attempts));
    BOOST_TEST((checked.error().code() == errc::start_failed));
    BOOST_TEST(checked.error().message().find("another user can't run /opt/webots") != std::string::npos,
               checked.error().message());
    for (auto const& process : processes.started())
        BOOST_TEST(process.user.has_value());
}

BOOST_AUTO_TEST_SUITE_END()
