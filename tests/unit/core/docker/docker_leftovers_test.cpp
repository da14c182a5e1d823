#include "unit_test.hpp"

#include "core/docker/docker_leftovers.hpp"

using namespace webots_cloud::core;
using namespace std::chrono_literals;

// Protocol section 6.5, and quirk Q27.
BOOST_AUTO_TEST_SUITE(docker_leftovers)

namespace {

using Names = std::vector<std::string>;

constexpr auto identity = "webots-2000-1f3a9c4d";

DockerScope scope(std::string project = {})
{
    DockerScope scope;
    scope.identity = identity;
    scope.project = std::move(project);
    return scope;
}

// What `docker ps --all` says.
constexpr auto containers = "aaa\t\"webots-2000-1f3a9c4d-run1-1\"\t\"webots-2000-1f3a9c4d\"\tUp 3 seconds\n"
                            "bbb\t\"webots-2000-1f3a9c4d-run1-17\"\t\"\"\tCreated\n"
                            "ccc\t\"webots-2000-1f3a9c4d0-run1-1\"\t\"\"\tUp 3 seconds\n"
                            "ddd\t\"webots-3000-1f3a9c4d-run1-1\"\t\"\"\tUp 3 seconds\n"
                            "eee\t\"blog\"\t\"\"\tExited (1) 3 days ago\n"
                            "fff\t\"\"\t\"\"\tExited (1) 3 days ago\n"
                            "ggg\t\"\"\t\"webots-2000-1f3a9c4d\"\tExited (2) 5 seconds ago\n"
                            "hhh\t\"\"\t\"webots-2000-1f3a9c4d\"\tExited (0) 1 second ago\n"
                            "iii\t\"\"\t\"webots-2000-1f3a9c4d\"\tUp 1 second\n"
                            "jjj\t\"\"\t\"webots-3000-00000000\"\tExited (2) 5 seconds ago\n"
                            "kkk\t\"\"\t\"webots-2000-1f3a9c4d\"\tCreated\n"
                            "lll\t\"\"\t\"webots-3000-00000000\"\tCreated\n";

ImagePolicy policy()
{
    ImagePolicy policy;
    policy.repository = "cyberbotics/webots.cloud";
    policy.persistent = {"cyberbotics/webots.cloud:R2025a-ubuntu22.04"};
    return policy;
}

} // namespace

BOOST_AUTO_TEST_CASE(servers_on_other_machines_ports_and_folders_have_other_names)
{
    auto const ours = docker_identity("m", 2000, "/tmp/a");
    BOOST_TEST(ours.starts_with("webots-2000-"));
    BOOST_TEST(ours.size() == 20u);
    BOOST_TEST(ours == docker_identity("m", 2000, "/tmp/a"));
    BOOST_TEST(ours != docker_identity("n", 2000, "/tmp/a"));
    BOOST_TEST(ours != docker_identity("m", 3000, "/tmp/a"));
    BOOST_TEST(ours != docker_identity("m", 2000, "/tmp/b"));
}

BOOST_AUTO_TEST_CASE(of_a_simulation_its_own_containers_go_and_builds_that_have_failed)
{
    BOOST_TEST(leftovers(containers, scope("webots-2000-1f3a9c4d-run1-1")) == (Names{"aaa", "ggg"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(of_a_dead_predecessor_all_containers_go_and_of_strangers_none)
{
    BOOST_TEST(leftovers(containers, scope()) == (Names{"aaa", "bbb", "ggg"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(steps_of_our_builds_that_were_not_started_are_told_from_everything_else)
{
    BOOST_TEST(unstarted_builds(containers, identity) == (Names{"kkk"}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(networks_and_volumes_are_known_by_their_project)
{
    constexpr auto networks = "n1\t\"\"\nn2\t\"webots-2000-1f3a9c4d-run1-1\"\nn3\t\"blog\"\n\n";
    BOOST_TEST(leftovers(networks, scope()) == (Names{"n2"}), boost::test_tools::per_element());
    BOOST_TEST(leftovers("", scope()).empty());
    BOOST_TEST(leftovers("rubbish\n\t\n", scope()).empty());
}

BOOST_AUTO_TEST_CASE(default_images_go_that_are_older_than_48_hours_and_not_kept_by_the_operator)
{
    constexpr auto images = "cyberbotics/webots.cloud:R2025a-ubuntu22.04\t2025-01-30 10:00:00 +0000 UTC\n"
                            "cyberbotics/webots.cloud:R2023b-ubuntu22.04\t2023-06-30 10:00:00 +0200 CEST\n"
                            "cyberbotics/webots.cloud:R2023a-ubuntu20.04\t2026-11-19 11:59:00 +0000 UTC\n"
                            "cyberbotics/webots.cloud:R2022b-ubuntu20.04\t2026-11-19 12:01:00 +0000 UTC\n"
                            "webots-2000-1f3a9c4d-1-0a_webots:latest\t2026-11-01 12:00:00 +0000 UTC\n"
                            "cyberbotics/webots.cloud-other:1\t2023-06-30 10:00:00 +0000 UTC\n"
                            "<none>:<none>\t2023-06-30 10:00:00 +0000 UTC\n"
                            "cyberbotics/webots.cloud:R2021b-ubuntu20.04\tlong ago\n"
                            "debian:12\t2023-06-30 10:00:00 +0000 UTC\n";
    auto const now = std::chrono::sys_days(std::chrono::year(2026) / 11 / 21) + 12h;
    BOOST_TEST(old_images(images, policy(), now) == (Names{"cyberbotics/webots.cloud:R2023b-ubuntu22.04",
                                                           "cyberbotics/webots.cloud:R2023a-ubuntu20.04"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(of_builds_that_have_lost_their_name_the_old_ones_go)
{
    constexpr auto images = "aaa\t2026-11-19 11:59:00 +0000 UTC\n"
                            "bbb\t2026-11-19 12:01:00 +0000 UTC\n"
                            "--all\t2026-11-01 12:00:00 +0000 UTC\n"
                            "ccc\tlong ago\n";
    auto const now = std::chrono::sys_days(std::chrono::year(2026) / 11 / 21) + 12h;
    BOOST_TEST(old_builds(images, now) == (Names{"aaa"}), boost::test_tools::per_element());
    BOOST_TEST(list_builds(identity).at(4) == "label=webots_cloud.server=webots-2000-1f3a9c4d");
}

BOOST_AUTO_TEST_CASE(of_an_ended_simulation_no_image_keeps_its_name_and_of_strangers_every_one)
{
    constexpr auto images = "webots-2000-1f3a9c4d-1-0a_webots:latest\tnow\n"
                            "webots-2000-1f3a9c4d-1-0a-controller:latest\tnow\n"
                            "webots-2000-1f3a9c4d-1-0ab_webots:latest\tnow\n"
                            "webots-2000-1f3a9c4d0-1-0a_webots:latest\tnow\n"
                            "webots-3000-1f3a9c4d-1-0a_webots:latest\tnow\n"
                            "registry.example/webots-2000-1f3a9c4d-1-0a_webots:latest\tnow\n"
                            "<none>:<none>\tnow\n";
    BOOST_TEST(
        named_images(images, scope("webots-2000-1f3a9c4d-1-0a")) ==
            (Names{"webots-2000-1f3a9c4d-1-0a_webots:latest", "webots-2000-1f3a9c4d-1-0a-controller:latest"}),
        boost::test_tools::per_element());
    BOOST_TEST(named_images(images, scope()) == (Names{"webots-2000-1f3a9c4d-1-0a_webots:latest",
                                                       "webots-2000-1f3a9c4d-1-0a-controller:latest",
                                                       "webots-2000-1f3a9c4d-1-0ab_webots:latest"}),
               boost::test_tools::per_element());
}

// Labels of containers, networks and volumes are chosen by whoever makes them, and docker prints line ends
// and tabs in them as they are.
BOOST_AUTO_TEST_CASE(a_label_with_line_ends_names_nothing_of_others)
{
    constexpr auto listing = "aaa\t\"x\\nbbb\\twebots-2000-1f3a9c4d-run1-1\\t\\tUp\"\t\"\"\tUp 3 seconds\n"
                             "ccc\t\"\"\t\"webots-2000-1f3a9c4d\\nddd\"\tCreated\n"
                             "eee\t\"webots-2000-1f3a9c4d-run1-1\\n\"\t\"\"\tUp 3 seconds\n";
    BOOST_TEST(leftovers(listing, scope("webots-2000-1f3a9c4d-run1-1")).empty());
    BOOST_TEST(unstarted_builds(listing, identity).empty());
    constexpr auto forged =
        "bbb\twebots-2000-1f3a9c4d-run1-1\t\tUp\n" // as from a label with a line end in it
        "ddd\t\twebots-2000-1f3a9c4d\tCreated\n";
    BOOST_TEST(leftovers(forged, scope()).empty());
    BOOST_TEST(unstarted_builds(forged, identity).empty());
    for (auto const& format : {container_format, network_format, volume_format})
        for (auto at = format.find(".Label"); at != std::string_view::npos;
             at = format.find(".Label", at + 1))
            BOOST_TEST(format.substr(0, at).ends_with("{{json ("), format);
}

BOOST_AUTO_TEST_CASE(no_name_is_taken_for_an_option)
{
    constexpr auto listing = "--all\t\"webots-2000-1f3a9c4d-run1-1\"\t\"\"\tUp 3 seconds\n"
                             "-f\t\"\"\t\"webots-2000-1f3a9c4d\"\tCreated\n";
    BOOST_TEST(leftovers(listing, scope()).empty());
    BOOST_TEST(unstarted_builds(listing, identity).empty());
}

BOOST_AUTO_TEST_CASE(images_of_years_that_no_clock_can_say_stay)
{
    constexpr auto images = "cyberbotics/webots.cloud:a\t9999-12-31 10:00:00 +0000 UTC\n"
                            "cyberbotics/webots.cloud:b\t-999-12-31 10:00:00 +0000 UTC\n"
                            "cyberbotics/webots.cloud:c\t0001-01-01 00:00:00 +0000 UTC\n";
    auto const now = std::chrono::sys_days(std::chrono::year(2026) / 11 / 21);
    BOOST_TEST(old_images(images, policy(), now).empty());
}

BOOST_AUTO_TEST_CASE(containers_are_removed_before_the_networks_and_volumes_that_they_use)
{
    std::vector<std::string> order;
    for (auto const& kind : leftover_kinds())
        order.push_back(kind.list.at(0) + " " + kind.remove.at(0) + " " + kind.remove.at(1));
    BOOST_TEST(order ==
                   (Names{"ps rm --force", "network network rm", "volume volume rm", "images rmi --force"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_build_that_stays_unstarted_from_one_look_to_the_next_is_given_up)
{
    struct Look
    {
        Names found;
        Names removed;
        bool goes_on;
    };
    Look const timetable[] = {
        {{"a"}, {}, true},         // it may be about to start
        {{"a", "b"}, {"a"}, true}, // it was not
        {{"c"}, {}, true},         // b has started
        {{}, {}, true},            // once
        {{"c"}, {}, true},         // was not there at the last look
        {{"c"}, {"c"}, true},      //
        {{}, {}, true},            //
        {{}, {}, false},           // twice in a row
    };
    BuildWatch watch;
    BOOST_TEST(watch.goes_on());
    for (auto const& look : timetable) {
        BOOST_TEST(watch.look(look.found) == look.removed, boost::test_tools::per_element());
        BOOST_TEST(watch.goes_on() == look.goes_on);
    }
}

BOOST_AUTO_TEST_CASE(builds_are_not_watched_for_ever_whatever_is_found)
{
    BuildWatch watch;
    int looks = 0;
    for (; watch.goes_on() && looks < 100; ++looks)
        watch.look({"a"});
    BOOST_TEST(looks == 12);
}

BOOST_AUTO_TEST_SUITE_END()
