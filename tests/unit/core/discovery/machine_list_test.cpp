#include "unit_test.hpp"

#include "core/discovery/machine_list.hpp"

#include <webots_cloud/scheduler.hpp>

#include <algorithm>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(machine_list)

namespace {

constexpr std::size_t all = 1000;

std::string text_of(ServerSpec const& server)
{
    return server.address + (server.drain ? "-" : "");
}

std::string text_of(std::vector<ServerSpec> const& servers)
{
    std::string text;
    for (auto const& server : servers)
        text += (text.empty() ? "" : " ") + text_of(server);
    return text;
}

/// `+a<b`: a was added in front of b; `=`: changed; `-`: removed.
std::string text_of(std::vector<ServerChange> const& changes)
{
    std::string text;
    for (auto const& change : changes) {
        bool const is_removed = change.kind == ServerChange::Kind::removed;
        text += text.empty() ? "" : " ";
        text += change.kind == ServerChange::Kind::added ? "+" : is_removed ? "-" : "=";
        text += text_of(change.server) + (is_removed ? "" : "<" + change.before);
    }
    return text;
}

/// Who is told of changes has the same list.
void carry_out(std::vector<ServerChange> const& changes, std::vector<ServerSpec>& servers)
{
    for (auto const& change : changes) {
        auto const known = std::ranges::find(servers, change.server.address, &ServerSpec::address);
        BOOST_REQUIRE((known == servers.end()) == (change.kind == ServerChange::Kind::added));
        if (known != servers.end())
            servers.erase(known);
        auto const next = std::ranges::find(servers, change.before, &ServerSpec::address);
        BOOST_REQUIRE((next == servers.end()) == change.before.empty());
        if (change.kind != ServerChange::Kind::removed)
            servers.insert(next, change.server);
    }
}

} // namespace

BOOST_AUTO_TEST_CASE(machines_stand_in_the_order_of_who_names_them_and_of_their_addresses)
{
    MachineList list;
    list.name(2, ServerSpec("a"));
    list.name(1, ServerSpec("c"));
    list.name(1, ServerSpec("b"));
    BOOST_TEST(text_of(list.servers()) == "");
    BOOST_TEST(text_of(list.take(all)) == "+a< +b<a +c<a");
    BOOST_TEST(text_of(list.servers()) == "b c a");
    list.forget(1, "c");
    list.name(0, ServerSpec("d"));
    BOOST_TEST(text_of(list.take(all)) == "-c +d<b");
    BOOST_TEST(text_of(list.servers()) == "d b a");
    BOOST_TEST(!list.is_outdated());
    BOOST_TEST(text_of(list.take(all)) == "");
}

BOOST_AUTO_TEST_CASE(of_several_who_name_a_machine_the_first_counts)
{
    MachineList list;
    ServerSpec drained("a");
    drained.drain = true;
    list.name(1, drained);
    list.name(2, ServerSpec("b"));
    (void)list.take(all);
    list.name(3, ServerSpec("a"));
    BOOST_TEST(text_of(list.take(all)) == "");
    list.forget(1, "a");
    list.forget(1, "b");
    BOOST_TEST(text_of(list.take(all)) == "=a<");
    BOOST_TEST(text_of(list.servers()) == "b a");
    list.name(0, drained);
    BOOST_TEST(text_of(list.take(all)) == "=a-<b");
    list.forget(0, "a");
    list.forget(3, "a");
    list.forget(3, "a");
    BOOST_TEST(text_of(list.take(all)) == "-a");
}

BOOST_AUTO_TEST_CASE(what_was_changed_back_is_no_change)
{
    MachineList list;
    list.name(0, ServerSpec("a"));
    (void)list.take(all);
    list.forget(0, "a");
    list.name(0, ServerSpec("b"));
    BOOST_TEST(list.is_outdated());
    list.name(0, ServerSpec("a"));
    list.forget(0, "b");
    BOOST_TEST(text_of(list.take(all)) == "");
    BOOST_TEST(text_of(list.servers()) == "a");
    BOOST_TEST(!list.is_outdated());
}

BOOST_AUTO_TEST_CASE(it_is_taken_in_steps_while_it_changes)
{
    RandomSource random(7);
    MachineList list;
    std::map<std::pair<std::size_t, std::string>, ServerSpec> named;
    std::vector<ServerSpec> told;
    for (int step = 0; step != 500; ++step) {
        for (std::uint64_t changes = random.below(8); changes != 0; --changes) {
            std::size_t const source = random.below(3);
            ServerSpec machine(std::to_string(random.below(30)));
            machine.drain = random.below(4) == 0;
            if (random.below(2) == 0) {
                list.name(source, machine);
                named[{source, machine.address}] = machine;
            } else {
                list.forget(source, machine.address);
                named.erase({source, machine.address});
            }
        }
        auto const changes = list.take(3);
        BOOST_REQUIRE(changes.size() <= 3u);
        carry_out(changes, told);
        BOOST_REQUIRE(text_of(told) == text_of(list.servers()));
    }
    carry_out(list.take(all), told);
    std::vector<ServerSpec> expected;
    for (auto const& [key, machine] : named)
        if (std::ranges::find(expected, machine.address, &ServerSpec::address) == expected.end())
            expected.push_back(machine);
    BOOST_TEST(text_of(told) == text_of(expected));
    BOOST_TEST(!expected.empty());
}

BOOST_AUTO_TEST_SUITE_END()
