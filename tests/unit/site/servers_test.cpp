#include "site/servers.hpp"

#include "unit_test.hpp"

namespace webots_cloud::site {
BOOST_AUTO_TEST_SUITE(site_servers)

namespace {

Process process(pid_t id, std::vector<std::string> arguments, uid_t user = 1000)
{
    Process made;
    made.id = id;
    made.user = user;
    made.arguments = std::move(arguments);
    return made;
}

Process session_server(pid_t id, std::string const& folder, uid_t user = 1000)
{
    return process(id, {folder + "/build/release/bin/webots-session-server", "config/session/local.json"},
                   user);
}

} // namespace

BOOST_AUTO_TEST_CASE(a_process_that_only_calls_itself_a_server_is_none)
{
    std::string const called = "/srv/a/build/release/bin/webots-session-server";
    auto server = session_server(1, "/srv/a");
    BOOST_TEST(!is_posing(server, called)); // of the same user, which keeps its memory to itself
    server.program = called;
    BOOST_TEST(!is_posing(server, called));
    server.program = called + " (deleted)"; // it was built again meanwhile
    BOOST_TEST(!is_posing(server, called));
    server.program = "/usr/bin/python3.11";
    BOOST_TEST(is_posing(server, called));
    server.program = called; // a simulation may find it beside its simulator
    server.is_inner = true;
    BOOST_TEST(is_posing(server, called));
}

BOOST_AUTO_TEST_CASE(the_command_line_of_a_server_says_which_one_it_is_and_what_it_runs_with)
{
    auto const server = parse_server({"/srv/a/build/release/bin/webots-simulation-server", "--move-ports=-12",
                                      "config/simulation/lan.json"});
    BOOST_REQUIRE(server);
    BOOST_TEST((server->kind == Kind::simulation));
    BOOST_TEST(checkout_of(*server) == "/srv/a");
    BOOST_TEST(configuration_path(*server) == "/srv/a/config/simulation/lan.json");
    BOOST_TEST(name_of(*server) == "lan");
    BOOST_TEST(server->moved == -12);
}

BOOST_AUTO_TEST_CASE(one_that_is_installed_belongs_to_no_checkout)
{
    auto const server = parse_server({"/usr/bin/webots-session-server", "/etc/webots-cloud/session.json"});
    BOOST_REQUIRE(server);
    BOOST_TEST(checkout_of(*server).empty());
    BOOST_TEST(configuration_path(*server) == "/etc/webots-cloud/session.json");
}

BOOST_AUTO_TEST_CASE(other_programs_are_no_servers)
{
    BOOST_TEST(!parse_server({}));
    BOOST_TEST(!parse_server({"/usr/bin/python3", "webots-session-server"}));
    BOOST_TEST(!parse_server({"/a/webots-session-server-2"}));
}

BOOST_AUTO_TEST_CASE(the_noted_number_counts_only_while_it_is_that_server)
{
    std::vector<Process> const processes{process(1, {"sleep", "600"}), session_server(2, "/srv/a"),
                                         session_server(3, "/srv/a")};
    BOOST_TEST(find_server(processes, Kind::session, "/srv/a", 3, 1000)->id == 3);
    BOOST_TEST(find_server(processes, Kind::session, "/srv/a", 1, 1000)->id == 2);
    BOOST_TEST(!find_server(processes, Kind::simulation, "/srv/a", 3, 1000));
    BOOST_TEST(!find_server(processes, Kind::session, "/srv/b", 3, 1000));
}

BOOST_AUTO_TEST_CASE(the_noted_number_counts_where_the_folder_was_renamed_while_it_ran)
{
    std::vector<Process> processes{session_server(2, "/srv/a"), session_server(3, "/srv/a")};
    processes[0].is_moved = processes[1].is_moved = true;
    BOOST_TEST(find_server(processes, Kind::session, "/srv/b", 3, 1000)->id == 3);
    BOOST_TEST(!find_server(processes, Kind::session, "/srv/b", std::nullopt, 1000));
    BOOST_TEST(!find_server(processes, Kind::session, "/srv/b", 3, 1001), "of somebody else");
    processes[1].is_moved = false; // another checkout has that number now
    BOOST_TEST(!find_server(processes, Kind::session, "/srv/b", 3, 1000));
}

BOOST_AUTO_TEST_CASE(without_a_number_it_is_known_by_its_program_and_its_configuration)
{
    auto const elsewhere = process(4, {"/srv/a/build/release/bin/webots-session-server", "/tmp/mine.json"});
    BOOST_TEST(!find_server({elsewhere}, Kind::session, "/srv/a", std::nullopt, 1000));
    auto const absolute =
        process(5, {"/srv/a/build/release/bin/webots-session-server", "/srv/a/config/session/lan.json"});
    BOOST_TEST(find_server({elsewhere, absolute}, Kind::session, "/srv/a", std::nullopt, 1000)->id == 5);
}

BOOST_AUTO_TEST_CASE(what_a_stranger_calls_by_that_name_is_not_ours)
{
    std::vector<Process> const of_others{session_server(6, "/srv/a", 1001)};
    BOOST_TEST(!find_server(of_others, Kind::session, "/srv/a", std::nullopt, 1000));
    BOOST_TEST(find_server(of_others, Kind::session, "/srv/a", std::nullopt, 0));
    std::vector<Process> const of_root{session_server(7, "/srv/a", 0)};
    BOOST_TEST(find_server(of_root, Kind::session, "/srv/a", std::nullopt, 1000)->id == 7);
}

BOOST_AUTO_TEST_CASE(a_process_that_has_ended_has_no_beginning)
{
    std::string const rest = " 1 2 2 0 -1 4194560 100 0 0 0 1 2 0 0 20 0 1 0 5318008 1000 200";
    BOOST_TEST(parse_beginning("12 (a) b) S" + rest).value() == 5318008);
    BOOST_TEST(!parse_beginning("12 (a) Z" + rest));
    BOOST_TEST(!parse_beginning("12 (a)"));
    BOOST_TEST(!parse_beginning(""));
}

BOOST_AUTO_TEST_SUITE_END()

} // namespace webots_cloud::site
