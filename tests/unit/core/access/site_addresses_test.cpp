#include "unit_test.hpp"

#include "core/access/site_addresses.hpp"

#include <string>

using namespace webots_cloud;
using core::SiteAddresses;

BOOST_AUTO_TEST_SUITE(site_addresses)

namespace {

/// A site at wss://sim.example.org, and a machine of it behind the gateway where there is one.
struct Fixture
{
    Fixture()
    {
        own.host = "sim.example.org";
        own.port = 443;
        asked.host = own.host;
        ServerSpec inside("sim.example.org/2000");
        inside.internal_address = "10.0.0.2:2000";
        ServerSpec found("10.0.0.3:2000");
        found.internal_address = found.address;
        found.has_own_path = true;
        fleet.add_observer(paths);
        fleet.set({inside, found, ServerSpec("sim.example.org/3000"), ServerSpec("*/2000")});
    }

    std::string path_of_found() const { return std::string(paths.path_of("10.0.0.3:2000")); }

    PublicAddress own;
    std::vector<std::string> names;
    SessionServiceConfig config;
    Fleet fleet{[](std::string_view) { return std::string(32, 'x'); }};
    core::MachinePaths paths;
    SiteAddresses addresses{own, names, config, fleet, paths};
    AskedAddress asked;
};

} // namespace

BOOST_AUTO_TEST_CASE(without_gateway_machines_are_where_their_entries_say)
{
    Fixture fixture;
    auto const& addresses = fixture.addresses;
    for (auto const* entry : {"sim.example.org/2000", "other.example.org:2000"}) {
        BOOST_TEST(addresses.address_of(entry, fixture.asked) == std::string("wss://") + entry);
        BOOST_TEST(addresses.address_below_us(entry, fixture.asked).empty(), entry);
        BOOST_TEST(!addresses.is_closed(entry, ""), entry);
    }
    fixture.asked.host = "pc7:1999";
    BOOST_TEST(addresses.address_of("*/2000", fixture.asked) == "wss://pc7:1999/2000");
    BOOST_TEST(addresses.address_of("*:2000", fixture.asked) == "wss://pc7:2000");
}

BOOST_AUTO_TEST_CASE(a_machine_with_a_path_of_its_own_is_below_the_server)
{
    Fixture fixture;
    auto const path = fixture.path_of_found();
    BOOST_TEST(path.starts_with("/machine/"));
    BOOST_TEST(fixture.addresses.address_of("10.0.0.3:2000", fixture.asked) ==
               "wss://sim.example.org" + path);
    BOOST_TEST(fixture.addresses.address_of("*" + path + "/simulation/abc/2001", fixture.asked) ==
               "wss://sim.example.org" + path + "/simulation/abc/2001");
    BOOST_TEST(fixture.addresses.depends_on_asked("other.example.org:2000"));
    fixture.fleet.set({});
    BOOST_TEST(!fixture.addresses.depends_on_asked("other.example.org:2000"));
    BOOST_TEST(fixture.addresses.depends_on_asked("*:2000"));
}

BOOST_AUTO_TEST_CASE(at_an_unusual_port_those_behind_the_gateway_are_found_at_that_port)
{
    Fixture fixture;
    fixture.own.port = 8443;
    fixture.own.port_rewrite = false;
    fixture.asked.host = "sim.example.org:8443";
    auto const address = [&](std::string_view entry) {
        return fixture.addresses.address_of(entry, fixture.asked);
    };
    BOOST_TEST(address("sim.example.org/2000") == "wss://sim.example.org/2000");
    BOOST_TEST(fixture.addresses.path_unknown_to_machine("/2000/client", fixture.asked).empty());
    fixture.config.gateway = true;
    BOOST_TEST(address("sim.example.org/2000") == "wss://sim.example.org:8443/2000");
    BOOST_TEST(fixture.addresses.is_closed("sim.example.org/2000", "/2000"));
    BOOST_TEST(fixture.addresses.path_unknown_to_machine("/2000/client", fixture.asked) == "/2000");
    BOOST_TEST(address("sim.example.org/3000") == "wss://sim.example.org/3000",
               "it is not known from inside, so another server leads to it");
    BOOST_TEST(fixture.addresses.path_unknown_to_machine("/3000/client", fixture.asked).empty());
    BOOST_TEST(fixture.addresses.path_unknown_to_machine("/session", fixture.asked).empty());
}

BOOST_AUTO_TEST_CASE(below_the_path_of_a_proxy_are_the_machines_as_well)
{
    Fixture fixture;
    fixture.config.gateway = true;
    fixture.own.ssl = false;
    fixture.asked.path = "/webots";
    fixture.asked.tls = true;
    auto const& addresses = fixture.addresses;
    BOOST_TEST(addresses.own_base(fixture.asked) == "wss://sim.example.org/webots");
    BOOST_TEST(addresses.address_of("sim.example.org/2000", fixture.asked) ==
               "wss://sim.example.org/webots/2000");
    BOOST_TEST(addresses.address_of("*/2000/simulation/abc/2001", fixture.asked) ==
               "wss://sim.example.org/webots/2000/simulation/abc/2001");
    BOOST_TEST(addresses.path_unknown_to_machine("/2000/client", fixture.asked) == "/2000");
}

BOOST_AUTO_TEST_SUITE_END()
