#include "unit_test.hpp"

#include "core/docker/container_walls.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(container_walls)

namespace {

constexpr char const* competition = "# A competition\n"
                                    "version: \"3.8\"\n"
                                    "\n"
                                    "services:\n"
                                    "  webots:\n"
                                    "    image: x\n"
                                    "    volumes:\n"
                                    "      - /tmp/.X11-unix:/tmp/.X11-unix\n"
                                    "\n"
                                    "  # the participant's\n"
                                    "  controller: &anchor\n"
                                    "    build: ./controllers\n"
                                    "  theia:\n"
                                    "    image: y\n"
                                    "\n"
                                    "volumes:\n"
                                    "  project:\n";

} // namespace

BOOST_AUTO_TEST_CASE(the_services_of_a_compose_file_are_found)
{
    using Names = std::vector<std::string>;
    BOOST_TEST((compose_services(competition) == Names{"webots", "controller", "theia"}));
    BOOST_TEST((compose_services("services:\n    \"a\":\n        image: x\n    'b':\n        image: y\n") ==
                Names{"a", "b"}));
    BOOST_TEST(compose_services("services: {webots: {image: x}}\n").empty());
    BOOST_TEST(compose_services("").empty());
}

BOOST_AUTO_TEST_CASE(each_service_loses_its_capabilities_but_the_editor_which_is_not_ours)
{
    BOOST_TEST(walls_file(competition, ContainerWalls()) == "version: \"3.8\"\n"
                                                            "services:\n"
                                                            "  webots:\n"
                                                            "    cap_drop: [ALL]\n"
                                                            "    security_opt:\n"
                                                            "      - no-new-privileges:true\n"
                                                            "    volumes:\n"
                                                            "      - type: tmpfs\n"
                                                            "        target: /tmp/.X11-unix\n"
                                                            "  controller:\n"
                                                            "    cap_drop: [ALL]\n"
                                                            "    security_opt:\n"
                                                            "      - no-new-privileges:true\n"
                                                            "  theia:\n"
                                                            "    cap_drop: [MKNOD, NET_RAW]\n"
                                                            "    security_opt:\n"
                                                            "      - no-new-privileges:true\n");
}

BOOST_AUTO_TEST_CASE(sockets_of_displays_are_covered_where_they_would_be_seen)
{
    auto const text = walls_file(competition, ContainerWalls());
    constexpr char const* cover = "    volumes:\n      - type: tmpfs\n        target: /tmp/.X11-unix\n";
    auto const found = text.find(cover);
    BOOST_TEST(found < text.find("  controller:"));
    BOOST_TEST(text.find(cover, found + 1) == std::string::npos);
}

BOOST_AUTO_TEST_CASE(of_the_sockets_of_displays_the_one_that_is_meant_is_seen)
{
    ContainerWalls walls;
    walls.display_socket = "/tmp/.X11-unix/X1";
    auto const text = walls_file(competition, walls);
    auto const found = text.find("      - type: tmpfs\n"
                                 "        target: /tmp/.X11-unix\n"
                                 "      - type: bind\n"
                                 "        source: /tmp/.X11-unix/X1\n"
                                 "        target: /tmp/.X11-unix/X1\n"
                                 "        read_only: true\n");
    BOOST_TEST(found < text.find("  controller:"));
    BOOST_TEST(text.find("bind", found + 100) == std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_simulator_that_starts_its_display_is_not_the_first_process)
{
    ContainerWalls walls;
    BOOST_TEST(walls_file(competition, walls).find("init") == std::string::npos);
    walls.own_display = true;
    auto const text = walls_file(competition, walls);
    auto const found = text.find("    init: true\n");
    BOOST_TEST(found < text.find("  controller:"));
    BOOST_TEST(text.find("init", found + 10) == std::string::npos);
}

BOOST_AUTO_TEST_CASE(simulators_get_their_network_from_us_and_controllers_none)
{
    ContainerWalls walls;
    walls.own_network = true;
    walls.name_server = "10.0.2.3";
    auto const text = walls_file(competition, walls);
    auto const mode = text.find("    network_mode: none\n    dns: [10.0.2.3]\n");
    BOOST_TEST(mode < text.find("  controller:"));
    auto const second = text.find("    network_mode: none\n", mode + 1);
    BOOST_TEST(second < text.find("  theia:"));
    BOOST_TEST(text.find("network_mode", second + 20) == std::string::npos);
    walls.name_server.clear();
    BOOST_TEST(walls_file(competition, walls).find("dns") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(the_simulator_alone_has_a_label_that_nobody_guesses)
{
    ContainerWalls walls;
    BOOST_TEST(walls_file(competition, walls).find("labels") == std::string::npos);
    walls.token = "0a1b";
    auto const text = walls_file(competition, walls);
    auto const found = text.find("    labels:\n      webots_cloud.simulator: \"0a1b\"\n");
    BOOST_TEST(found < text.find("  controller:"));
    BOOST_TEST(text.find("labels", found + 10) == std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_network_that_the_operator_has_chosen_is_seen)
{
    BOOST_TEST(!chooses_network(competition));
    BOOST_TEST(chooses_network("services:\n  webots:\n    network_mode: host\n"));
    BOOST_TEST(chooses_network("services:\n  webots:\n    networks: [lab]\n"));
    BOOST_TEST(!chooses_network("services:\n  webots:\n    image: x\n  other:\n    networks: [lab]\n"));
}

BOOST_AUTO_TEST_CASE(services_may_use_the_system_calls_of_a_list)
{
    ContainerWalls walls;
    BOOST_TEST(walls_file(competition, walls).find("seccomp") == std::string::npos);
    walls.system_calls = true;
    auto const text = walls_file(competition, walls);
    constexpr char const* line = "      - no-new-privileges:true\n"
                                 "      - seccomp:docker-compose.seccomp.json\n";
    auto const first = text.find(line);
    BOOST_TEST(first < text.find("  controller:"));
    auto const second = text.find(line, first + 1);
    BOOST_TEST(second < text.find("  theia:"));
    BOOST_TEST(text.rfind("seccomp") < text.find("  theia:"));
    BOOST_TEST(walls_file("services:\n  webots:\n    security_opt:\n      - seccomp:unconfined\n", walls)
                   .find("seccomp") == std::string::npos);
}

// Compose 2 refuses lists of which two files have the same item.
BOOST_AUTO_TEST_CASE(an_option_that_the_operator_has_set_is_not_set_again)
{
    constexpr auto set = "services:\n  webots:\n    security_opt:\n      - no-new-privileges:true\n";
    ContainerWalls walls;
    BOOST_TEST(walls_file(set, walls).find("security_opt") == std::string::npos);
    walls.system_calls = true;
    BOOST_TEST(
        walls_file(set, walls).find("    security_opt:\n      - seccomp:docker-compose.seccomp.json\n") !=
        std::string::npos);
    BOOST_TEST(walls_file(set, walls).find("no-new-privileges") == std::string::npos);
    constexpr auto cleared = "services:\n  webots:\n    security_opt:\n      - no-new-privileges:false\n";
    BOOST_TEST(walls_file(cleared, walls).find("      - no-new-privileges:true\n") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(images_are_built_without_a_network_where_the_operator_has_not_chosen_one)
{
    ContainerWalls walls;
    walls.builds_without_network = true;
    constexpr char const* line = "    build:\n      network: none\n";
    auto const built = "services:\n  webots:\n    build:\n      context: .\n";
    BOOST_TEST(walls_file(built, walls).find(line) != std::string::npos);
    BOOST_TEST(walls_file(std::string(built) + "      network: lab\n", walls).find(line) ==
               std::string::npos);
    BOOST_TEST(walls_file("services:\n  webots:\n    image: x\n", walls).find(line) == std::string::npos);
    BOOST_TEST(walls_file(built, ContainerWalls()).find(line) == std::string::npos);
    auto const participant = "services:\n  controller:\n    build:\n      context: controllers\n";
    BOOST_TEST(walls_file(participant, walls).find(line) == std::string::npos);
    walls = ContainerWalls();
    walls.controller_builds_without_network = true;
    BOOST_TEST(walls_file(participant, walls).find(line) != std::string::npos);
    BOOST_TEST(walls_file(built, walls).find(line) == std::string::npos);
}

BOOST_AUTO_TEST_CASE(each_service_gets_the_limits_of_a_simulation)
{
    ContainerWalls walls;
    walls.limits.memory = 2'000'000;
    walls.limits.processors = 1.5;
    walls.limits.processes = 50;
    walls.limits.files = 100;
    walls.limits.disk = 4'000'000;
    BOOST_TEST(walls_file("services:\n  webots:\n    image: x\n", walls) ==
               "\nservices:\n"
               "  webots:\n"
               "    cap_drop: [ALL]\n"
               "    security_opt:\n"
               "      - no-new-privileges:true\n"
               "    mem_limit: 2000000\n"
               "    memswap_limit: 2000000\n"
               "    cpus: 1.5\n"
               "    pids_limit: 50\n"
               "    ulimits:\n"
               "      nofile: 100\n"
               "      fsize: 4000000\n"
               "    logging:\n"
               "      driver: json-file\n"
               "      options: {max-size: 1m, max-file: \"2\"}\n");
    constexpr char const* own_log = "services:\n  webots:\n    logging:\n      driver: syslog\n";
    BOOST_TEST(walls_file(own_log, walls).find("logging") == std::string::npos);
}

BOOST_AUTO_TEST_SUITE_END()
