#include "unit_test.hpp"

#include "core/docker/build_limits.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(limits_of_builds)

namespace {

using Words = std::vector<std::string>;

} // namespace

BOOST_AUTO_TEST_CASE(steps_of_builds_are_told_from_services_of_compose)
{
    auto const arguments =
        watch_starts("webots-2000-1f3a9c4d", WallTime(std::chrono::milliseconds(1700000000999)));
    BOOST_TEST(arguments.at(2) == "1700000000");
    BOOST_TEST(arguments.at(6) == "label=webots_cloud.server=webots-2000-1f3a9c4d");
    BOOST_TEST(build_step("0a1b2c\t\"\"").value() == "0a1b2c");
    BOOST_TEST(build_step("0a1b2c\t\"\"\r").value() == "0a1b2c");
    for (auto const line : {"", "0a1b2c", "0a1b2c\t\"webots-2000-1f3a9c4d-1-0a\"", "--all\t\"\"", "\t\"\"",
                            "0a1b2c\t\"\"\tx", "0a1b2c\t", "error: no daemon\t\"\""})
        BOOST_TEST(!build_step(line).has_value(), line);
}

BOOST_AUTO_TEST_CASE(a_step_of_a_build_is_limited_as_a_simulation_is)
{
    ProcessLimits limits;
    BOOST_TEST(limit_container(limits, "0a").empty());
    limits.files = 100; // which docker takes at the start of a container alone
    BOOST_TEST(limit_container(limits, "0a").empty());
    limits.memory = 2'000'000;
    limits.processors = 1.5;
    limits.processes = 50;
    BOOST_TEST(limit_container(limits, "0a") ==
                   (Words{"update", "--memory", "2000000", "--memory-swap", "2000000", "--cpus", "1.5",
                          "--pids-limit", "50", "0a"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(what_steps_have_written_is_read_of_containers_alone)
{
    BOOST_TEST(list_step_sizes({"0a", "0b"}) ==
                   (Words{"ps", "--no-trunc", "--size", "--format", "{{.ID}}\t{{.Size}}", "--filter", "id=0a",
                          "--filter", "id=0b"}),
               boost::test_tools::per_element());
    auto const sizes =
        read_step_sizes("0a\t1.5MB (virtual 1GB)\r\n0b\t0B (virtual 1GB)\n--all\t9GB\n0c\nx\t9GB\n");
    BOOST_TEST((sizes == std::map<std::string, std::uint64_t>{{"0a", 1'500'000}, {"0b", 0}}));
}

BOOST_AUTO_TEST_SUITE_END()
