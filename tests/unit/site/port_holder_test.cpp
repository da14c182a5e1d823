#include "site/port_holder.hpp"

#include "unit_test.hpp"

namespace webots_cloud::site {
BOOST_AUTO_TEST_SUITE(site_port_holder)

namespace {

constexpr auto table =
    "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n"
    "   0: 0100007F:07D0 00000000:0000 0A 00000000:00000000 00:00000000 00000000  1000        0 4711 1 0 "
    "100\n"
    "   1: 0100007F:07D0 0100007F:D431 01 00000000:00000000 00:00000000 00000000  1000        0 4712 1 0 "
    "100\n"
    "   2: 00000000:07D1 00000000:0000 0A 00000000:00000000 00:00000000 00000000     0        0 4713 1 0 "
    "100\n";

Suspect suspect(pid_t id, uid_t user, std::vector<std::uint64_t> sockets, std::vector<std::uint16_t> ports)
{
    Suspect made;
    made.process.id = id;
    made.process.user = user;
    made.sockets = std::move(sockets);
    made.ports = std::move(ports);
    return made;
}

Process running(std::string const& program, std::string const& configuration)
{
    Process made;
    made.id = 42;
    made.arguments = {program, configuration};
    return made;
}

} // namespace

BOOST_AUTO_TEST_CASE(only_sockets_that_listen_on_the_port_count)
{
    BOOST_TEST((parse_listeners(table, 2000) == std::vector<Listener>{{4711, 1000}}));
    BOOST_TEST((parse_listeners(table, 2001) == std::vector<Listener>{{4713, 0}}));
    BOOST_TEST(parse_listeners(table, 2002).empty());
    BOOST_TEST(parse_listeners("", 2000).empty());
}

BOOST_AUTO_TEST_CASE(whoever_has_the_socket_has_the_port_whatever_a_configuration_says)
{
    std::vector<Suspect> const all{suspect(1, 1000, {}, {2000}), suspect(2, 1000, {4711}, {})};
    BOOST_TEST(holder_of(2000, {{4711, 1000}}, all)->process.id == 2);
}

BOOST_AUTO_TEST_CASE(a_server_whose_sockets_are_hidden_is_known_by_its_configuration_and_its_user)
{
    std::vector<Suspect> const all{suspect(1, 1000, {}, {1999}), suspect(2, 1000, {}, {2000})};
    BOOST_TEST(holder_of(2000, {{4711, 1000}}, all)->process.id == 2);
    BOOST_TEST(!holder_of(2000, {{4711, 1001}}, all));
    BOOST_TEST(!holder_of(2000, {}, all));
}

BOOST_AUTO_TEST_CASE(a_server_of_another_checkout_is_told_with_the_command_that_stops_it)
{
    auto const process =
        running("/srv/my site/build/release/bin/webots-simulation-server", "config/simulation/local.json");
    auto holder = describe_holder(process, "", true);
    BOOST_TEST(holder.who == "a simulation server of /srv/my site (42)");
    BOOST_TEST(holder.remedy == "Stop it with '/srv/my site/server.sh' stop");
    holder = describe_holder(process, "ada", false);
    BOOST_TEST(holder.remedy == "Stop it with kill 42, as ada or root");
}

BOOST_AUTO_TEST_CASE(a_service_is_told_with_that_of_systemd)
{
    auto const holder = describe_holder(
        running("/usr/bin/webots-session-server", "/etc/webots-cloud/session.json"), "", false);
    BOOST_TEST(holder.who == "the session server that is installed on this machine (42)");
    BOOST_TEST(holder.remedy == "Stop it with sudo systemctl stop webots-session-server");
}

BOOST_AUTO_TEST_CASE(another_program_is_told_by_its_name)
{
    BOOST_TEST(describe_holder(running("/usr/bin/python3", "x"), "", false).who ==
               "another program, python3 (42)");
    BOOST_TEST(Holder().who == "another program");
}

BOOST_AUTO_TEST_CASE(each_place_that_names_a_port_is_told)
{
    PortUse use;
    use.kind = Kind::simulation;
    use.name = "local";
    use.has_session = true;
    use.has_website = true;
    use.site_port = 1999;
    BOOST_TEST(other_ports(use) ==
               "move the whole site with ./server.sh start --port 2999, or change \"port\" in "
               "config/simulation/local.json and \"simulationServers\" in config/session/local.json");
    use.kind = Kind::session;
    use.name = "lan";
    use.site_port = 65'000;
    BOOST_TEST(other_ports(use) ==
               "move the whole site with ./server.sh start lan --port 64000, or change \"port\" in "
               "config/session/lan.json and \"sessionServer\" in config/website_host/lan.json");
    use.is_redirect = true;
    BOOST_TEST(other_ports(use) ==
               "move the whole site with ./server.sh start lan --port 64000, or change \"redirectPort\" in "
               "config/session/lan.json");
}

BOOST_AUTO_TEST_SUITE_END()

} // namespace webots_cloud::site
