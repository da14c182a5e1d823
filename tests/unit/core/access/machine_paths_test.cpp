#include "unit_test.hpp"

#include "core/access/machine_paths.hpp"
#include "core/text.hpp"

#include <webots_cloud/scheduler.hpp>

#include <string>

using namespace webots_cloud;
using core::MachinePaths;

BOOST_AUTO_TEST_SUITE(machine_paths)

namespace {

/// Not a good one, but it tells apart what the tests have.
std::string mac(std::string_view message)
{
    RandomSource bytes(std::hash<std::string_view>()(message));
    std::string code(32, '\0');
    for (auto& each : code)
        each = static_cast<char>(bytes.below(256));
    return code;
}

ServerSpec found_machine(std::string address, std::string internal)
{
    ServerSpec spec(std::move(address));
    spec.internal_address = std::move(internal);
    spec.has_own_path = true;
    return spec;
}

struct Fixture
{
    Fixture()
    {
        fleet.add_observer(paths);
        for (auto const& server : servers) {
            fleet.put(server);
            paths.answered(server.address, true);
        }
    }

    std::string below(std::string_view address, std::string_view rest) const
    {
        return core::concat(paths.path_of(address), rest);
    }

    /// `host port target`; `silent`: it does not answer; empty: not passed on.
    std::string found(std::string_view path, std::string_view query = "") const
    {
        auto const answer = paths.find(path, query);
        if (!answer)
            return "";
        if (!answer->target)
            return "silent";
        auto const& machine = answer->target->machine;
        return core::concat(machine.tls ? "tls " : "", machine.host, " ", std::to_string(machine.port), " ",
                            answer->target->target);
    }

    std::vector<ServerSpec> servers{found_machine("10.0.0.2:2000", "10.0.0.2:2000"),
                                    found_machine("10.0.0.3:2000", "10.0.0.3:2000"),
                                    found_machine("sim4.test:2000", "https://sim4.test:2000")};
    Fleet fleet{mac};
    MachinePaths paths;
};

} // namespace

BOOST_AUTO_TEST_CASE(an_id_has_letters_alone_and_depends_on_address_and_secret)
{
    auto const id = core::machine_id(mac, "10.0.0.2:2000");
    BOOST_TEST(id.size() == 24);
    BOOST_TEST(id.find_first_not_of("abcdefghijklmnop") == std::string::npos);
    BOOST_TEST(id == core::machine_id(mac, "10.0.0.2:2000"));
    BOOST_TEST(id != core::machine_id(mac, "10.0.0.3:2000"));
    BOOST_TEST(id !=
               core::machine_id([](std::string_view) { return std::string(32, 'y'); }, "10.0.0.2:2000"));
}

BOOST_AUTO_TEST_CASE(a_path_leads_to_its_machine_and_is_taken_away)
{
    Fixture fixture;
    BOOST_TEST(fixture.paths.path_of("10.0.0.2:2000").starts_with("/machine/"));
    BOOST_TEST(fixture.found(fixture.below("10.0.0.2:2000", "/client")) == "10.0.0.2 2000 /client");
    BOOST_TEST(fixture.found(fixture.below("10.0.0.3:2000", ""), "a=/1&b") == "10.0.0.3 2000 /?a=/1&b");
    BOOST_TEST(fixture.found(fixture.below("sim4.test:2000", "/simulation/abc/2001/mjpeg")) ==
               "tls sim4.test 2000 /simulation/abc/2001/mjpeg");
}

BOOST_AUTO_TEST_CASE(nothing_else_is_passed_on)
{
    Fixture fixture;
    auto const path = fixture.below("10.0.0.2:2000", "/");
    auto const id = path.substr(9, 24);
    for (auto const& wrong :
         {core::concat("/machine/", id, "x/"), core::concat("/machine/", id.substr(1), "/"),
          core::concat("/machine//", id, "/"), core::concat("machine/", id, "/"),
          core::concat("/Machine/", id, "/"), core::concat("/machine/%61", id.substr(1)),
          core::concat("/machine/", id, ":80/"), core::concat("/x/machine/", id, "/"),
          std::string("/machine/10.0.0.2:2000/"), std::string("/machine/"), std::string("/machine"),
          std::string("/"), std::string()})
        BOOST_TEST(fixture.found(wrong) == "", wrong);
    for (auto const* rest : {"/metrics", "//metrics", "/METRICS", "/%6detrics", "/./metrics",
                             "/livez/../metrics", "/api", "/api/drain", "/%2fapi/drain"})
        BOOST_TEST(fixture.found(fixture.below("10.0.0.2:2000", rest)) == "", rest);
}

BOOST_AUTO_TEST_CASE(only_machines_that_have_answered_as_ours_are_passed_on_to)
{
    Fixture fixture;
    auto const path = fixture.below("10.0.0.2:2000", "/client");
    fixture.paths.answered("10.0.0.2:2000", false);
    BOOST_TEST(fixture.found(path) == "silent");
    fixture.paths.answered("10.0.0.2:2000", true);
    BOOST_TEST(fixture.found(path) == "10.0.0.2 2000 /client");
    fixture.fleet.put(found_machine("10.0.0.9:2000", "10.0.0.9:2000"));
    BOOST_TEST(fixture.found(fixture.below("10.0.0.9:2000", "/")) == "silent");
    BOOST_TEST(fixture.found(path) == "10.0.0.2 2000 /client", "what is known of the others stays");
    fixture.fleet.put(fixture.servers.front());
    BOOST_TEST(fixture.found(path) == "10.0.0.2 2000 /client", "nor does it change by being told again");
    fixture.servers.front().internal_address = "10.0.0.77:2000"; // who answered there was another one
    fixture.fleet.put(fixture.servers.front());
    BOOST_TEST(fixture.found(path) == "silent");
    fixture.paths.answered("10.0.0.88:2000", true); // of no machine of the list
    BOOST_TEST(fixture.paths.path_of("10.0.0.88:2000") == "");
}

BOOST_AUTO_TEST_CASE(a_path_goes_with_its_machine_and_comes_back_with_it)
{
    Fixture fixture;
    auto const path = fixture.below("10.0.0.2:2000", "/client");
    fixture.fleet.remove("10.0.0.2:2000");
    fixture.fleet.remove("10.0.0.2:2000");
    BOOST_TEST(fixture.found(path) == "");
    BOOST_TEST(fixture.paths.path_of("10.0.0.2:2000") == "");
    fixture.fleet.put(fixture.servers.front());
    BOOST_TEST(fixture.found(path) == "silent");
    fixture.paths.answered("10.0.0.2:2000", true);
    BOOST_TEST(fixture.found(path) == "10.0.0.2 2000 /client");
    for (auto const& server : fixture.servers)
        fixture.fleet.remove(server.address);
    BOOST_TEST(fixture.paths.empty());
}

BOOST_AUTO_TEST_CASE(passwords_are_for_the_monitors_of_trusted_machines_alone)
{
    Fixture fixture;
    auto const path = fixture.below("10.0.0.2:2000", "/monitor");
    BOOST_TEST((fixture.paths.find(path, "")->target->kind == UpstreamKind::machine));
    auto trusted = fixture.servers.front();
    trusted.trusted = true;
    fixture.fleet.put(trusted);
    auto const target = *fixture.paths.find(path, "")->target;
    BOOST_TEST((target.kind == UpstreamKind::trusted_monitor));
    BOOST_TEST(target.is_trusted);
}

BOOST_AUTO_TEST_CASE(a_machine_that_was_found_stays_known_to_be_elsewhere)
{
    Fixture fixture;
    auto const path = fixture.below("sim4.test:2000", "/client");
    BOOST_TEST(!fixture.paths.find(path, "")->target->is_elsewhere);
    auto found = fixture.servers.back();
    found.elsewhere = true;
    fixture.fleet.put(found);
    BOOST_TEST(fixture.paths.find(path, "")->target->is_elsewhere);
}

BOOST_AUTO_TEST_CASE(machines_that_browsers_reach_themselves_have_no_path)
{
    Fleet fleet(mac);
    MachinePaths paths;
    fleet.add_observer(paths);
    auto open = found_machine("10.0.0.2:2000", "10.0.0.2:2000");
    open.has_own_path = false;
    for (auto const& server : {open, ServerSpec("a:2000"), found_machine("b:2000", "")})
        fleet.put(server);
    BOOST_TEST(paths.empty());
    fleet.put(found_machine("10.0.0.2:2000", "10.0.0.2:2000"));
    fleet.put(open); // from now on
    BOOST_TEST(paths.empty());
    Fleet without_secret;
    without_secret.add_observer(paths);
    without_secret.put(found_machine("10.0.0.2:2000", "10.0.0.2:2000"));
    BOOST_TEST(paths.empty());
}

BOOST_AUTO_TEST_SUITE_END()
