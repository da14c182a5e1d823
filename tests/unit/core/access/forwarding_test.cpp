#include "unit_test.hpp"

#include "core/access/forwarding.hpp"

using namespace webots_cloud;
using core::ForwardingTable;

BOOST_AUTO_TEST_SUITE(forwarding)

namespace {

ServerSpec server(std::string address, std::string internal)
{
    ServerSpec spec(std::move(address));
    spec.internal_address = std::move(internal);
    return spec;
}

ForwardingTable table()
{
    auto plain = server("sim.example.org/4000", "10.0.0.4:4000");
    plain.first_port = 4001;
    plain.last_port = 4003;
    return ForwardingTable({server("sim.example.org/2000", "127.0.0.1:2000"),
                            server("sim.example.org/3000", "[2001:db8::3]:8080"), plain,
                            server("far.example.org:2000", ""), server("far.example.org/2500", ""),
                            server("sim.example.org/5000", "https://Sim5.example.org:5000"),
                            server("sim.example.org/6000", "wss://[2001:db8::6]:6000")});
}

/// `host port target`; nothing: not passed on.
std::string found(std::string_view path, std::string_view query = "")
{
    auto const target = table().find(path, query);
    if (!target)
        return "";
    auto const& machine = target->machine;
    return (machine.tls ? "tls " : "") + machine.host + " " + std::to_string(machine.port) + " " +
           target->target;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_port_leads_to_its_machine_and_is_taken_away)
{
    BOOST_TEST(found("/2000/client") == "127.0.0.1 2000 /client");
    BOOST_TEST(found("/3000/") == "2001:db8::3 8080 /");
    BOOST_TEST(found("/2000") == "127.0.0.1 2000 /");
    BOOST_TEST(found("/2000/simulation/abc/2001/mjpeg", "x=/1&y") ==
               "127.0.0.1 2000 /simulation/abc/2001/mjpeg?x=/1&y");
    BOOST_TEST(found("/4000/load") == "10.0.0.4 4000 /load");
}

BOOST_AUTO_TEST_CASE(ports_of_simulators_lead_to_the_same_machine)
{
    BOOST_TEST(found("/4001/") == "10.0.0.4 4001 /");
    BOOST_TEST(found("/4003/textures/a%20b.png") == "10.0.0.4 4003 /textures/a%20b.png");
    BOOST_TEST(found("/4004/") == "");
}

BOOST_AUTO_TEST_CASE(passwords_are_for_the_monitors_of_trusted_machines_alone)
{
    auto machine = server("sim.example.org/2000", "127.0.0.1:2000");
    machine.first_port = machine.last_port = 2001;
    auto const kind = [&machine](std::string_view path) {
        return ForwardingTable({machine}).find(path, "a=b").value().kind;
    };
    for (auto const* path : {"/2000/monitor", "/2000/", "/2000/load", "/2000/monitor/key"})
        BOOST_TEST((kind(path) == UpstreamKind::machine), path);
    BOOST_TEST(!ForwardingTable({machine}).find("/2000/monitor", "")->is_trusted);
    machine.trusted = true;
    BOOST_TEST((kind("/2000/monitor") == UpstreamKind::trusted_monitor));
    BOOST_TEST(ForwardingTable({machine}).find("/2000/load", "")->is_trusted);
    for (auto const* path : {"/2000/", "/2000/load", "/2000/monitor/", "/2000//monitor", "/2000/Monitor"})
        BOOST_TEST((kind(path) == UpstreamKind::machine), path);
    BOOST_TEST((kind("/2001/monitor") == UpstreamKind::simulation));
}

// Whose name leads to this machine itself, or where no machine is, is not reached there.
BOOST_AUTO_TEST_CASE(a_machine_that_was_found_stays_known_to_be_elsewhere)
{
    auto machine = server("sim.example.org/2000", "https://sim.example.org:2000");
    machine.first_port = machine.last_port = 2001;
    for (bool const elsewhere : {false, true}) {
        machine.elsewhere = elsewhere;
        for (auto const* path : {"/2000/client", "/2001/"})
            BOOST_TEST(ForwardingTable({machine}).find(path, "")->is_elsewhere == elsewhere, path);
    }
}

BOOST_AUTO_TEST_CASE(nothing_else_is_passed_on)
{
    for (auto const* path : {"/", "/session", "/22/", "/2001/", "/2500/", "/2000x/", "/02000/", "/+2000/",
                             "/67536/", "/0/", "//2000/", "/10.0.0.9:22/", "/http://10.0.0.9/",
                             "/2000@10.0.0.9/", "2000/", "/ 2000/", "/%32000/", "/-2000/"})
        BOOST_TEST(found(path) == "", path);
    BOOST_TEST(!ForwardingTable().find("/2000/client", ""));
    BOOST_TEST(ForwardingTable().empty());
    BOOST_TEST(!table().empty());
}

BOOST_AUTO_TEST_CASE(what_is_the_operators_is_not_passed_on_however_it_is_spelled)
{
    for (auto const* path : {"/2000/metrics", "/2000//metrics", "/2000/metrics/", "/2000/METRICS",
                             "/2000/%6detrics", "/2000/./metrics", "/2000/livez/../metrics", "/2000/api",
                             "/2000/api/drain", "/2000/%2fapi/drain", "/2000/../../api/x", "/2000/api//../x"})
        BOOST_TEST(found(path) == "", path);
    BOOST_TEST(found("/2000/metrics2") != "");
    BOOST_TEST(found("/2000/textures/metrics") != "");
    BOOST_TEST(found("/2000/%zz") != "");
}

// Between the machines of a site, TLS.
BOOST_AUTO_TEST_CASE(machines_may_be_reached_by_tls_and_by_name)
{
    BOOST_TEST(found("/5000/client") == "tls sim5.example.org 5000 /client");
    BOOST_TEST(found("/6000/") == "tls 2001:db8::6 6000 /");
    BOOST_TEST(core::internal_url("https://sim5:5000", "/load") == "https://sim5:5000/load");
    BOOST_TEST(core::internal_url("wss://[2001:db8::6]:6000", "/load") == "https://[2001:db8::6]:6000/load");
    BOOST_TEST(core::internal_url("10.0.0.2:2000", "/load") == "http://10.0.0.2:2000/load");
    for (auto const* good : {"https://10.0.0.2:2000", "wss://sim5:1", "https://a_b-c.d:65535"})
        BOOST_TEST(core::parse_internal_address(good)->tls, good);
    BOOST_TEST(!core::parse_internal_address("10.0.0.2:2000")->tls);
    for (auto const* bad :
         {"https://", "https://sim5", "https://sim5:", "https://sim5:0", "https://sim5:2000/",
          "https://:2000", "https://a@b:2000", "https://sim 5:2000", "https://10.0.0:2000",
          "https://10.0.0.256:2000", "http://sim5:2000", "http://10.0.0.2:2000", "sim5:2000",
          "ftp://sim5:2000", "https://https://sim5:2000", "https://[::1:2000", "https://sim5%00:2000"})
        BOOST_TEST(!core::parse_internal_address(bad), bad);
}

BOOST_AUTO_TEST_CASE(internal_addresses_are_numeric)
{
    for (auto const* good : {"10.0.0.2:2000", "[::1]:1", "127.0.0.1:65535"})
        BOOST_TEST(core::parse_numeric_address(good).has_value(), good);
    BOOST_TEST(core::parse_numeric_address("[2001:db8::2]:2000")->host == "2001:db8::2");
    for (auto const* bad :
         {"", ":2000", "localhost:2000", "10.0.0.2", "10.0.0.2:", "10.0.0.2:0", "10.0.0.2:65536", "::1:2000",
          "[::1]", "[10.0.0.2]:2000", "10.0.0.2:2000/x", "10.0.0.2:+1"})
        BOOST_TEST(!core::parse_numeric_address(bad), bad);
}

BOOST_AUTO_TEST_CASE(ports_are_one_or_a_range)
{
    BOOST_TEST((core::parse_port_range("2001") == std::pair<std::uint16_t, std::uint16_t>(2001, 2001)));
    BOOST_TEST((core::parse_port_range("2001-2100") == std::pair<std::uint16_t, std::uint16_t>(2001, 2100)));
    for (auto const* bad : {"", "-", "2001-", "-2001", "2100-2001", "0-5", "1-65536", "1-2-3", "1 - 2", "a"})
        BOOST_TEST(!core::parse_port_range(bad), bad);
}

BOOST_AUTO_TEST_SUITE_END()
