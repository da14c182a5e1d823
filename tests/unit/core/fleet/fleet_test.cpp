#include "unit_test.hpp"

#include "core/access/machine_paths.hpp"
#include "core/text.hpp"

#include <webots_cloud/fleet.hpp>
#include <webots_cloud/scheduler.hpp>

#include <memory>

using namespace webots_cloud;
using core::concat;

BOOST_AUTO_TEST_SUITE(fleet)

namespace {

/// Writes down what it is told: `+a<b` a has come in front of b, `~a` is another, `~a<` now at the end, `-a`
/// has left, `.` nothing else changes.
class Listener final : public FleetObserver
{
public:
    explicit Listener(std::string name = {}) : name_(std::move(name)) {}

    void put(FleetMachine const& machine, FleetMachine const* was,
             std::optional<std::string_view> before) override
    {
        note(concat(was ? "~" : "+", machine.spec.address, before ? "<" : "", before.value_or("")));
        if (was && was->drained_by() != machine.drained_by())
            note(concat("(", was->drained_by(), ">", machine.drained_by(), ")"));
    }
    void remove(FleetMachine const& machine) override { note(concat("-", machine.spec.address)); }
    void settled() override { note("."); }

    /// Since the last call.
    std::string told() { return std::exchange(*told_, {}); }
    /// Writes into the same text as another one.
    void write_with(Listener const& other) { told_ = other.told_; }

private:
    void note(std::string_view text) { *told_ += concat(told_->empty() ? "" : " ", name_, text); }

    std::string name_;
    std::shared_ptr<std::string> told_ = std::make_shared<std::string>();
};

std::vector<ServerSpec> specs(std::vector<std::string> const& addresses)
{
    std::vector<ServerSpec> specs;
    for (auto const& address : addresses)
        specs.emplace_back(address);
    return specs;
}

ServerChange change_of(ServerChange::Kind kind, std::string address, std::string before = {})
{
    ServerChange change;
    change.kind = kind;
    change.server.address = std::move(address);
    change.before = std::move(before);
    return change;
}

struct Fixture
{
    explicit Fixture(std::vector<std::string> const& addresses)
    {
        fleet.set(specs(addresses));
        fleet.add_observer(listener);
        (void)listener.told();
    }

    std::string order() const
    {
        std::string text;
        for (auto const& machine : fleet.machines())
            text += concat(text.empty() ? "" : " ", machine.spec.address);
        return text;
    }

    Fleet fleet;
    Listener listener;
};

} // namespace

BOOST_AUTO_TEST_CASE(machines_come_change_and_go_one_by_one)
{
    Fixture fixture({"a", "c"});
    fixture.fleet.put(ServerSpec("b"), "c");
    fixture.fleet.put(ServerSpec("d"));
    BOOST_TEST(fixture.listener.told() == "+b<c . +d< .");
    BOOST_TEST(fixture.order() == "a b c d");
    auto const* const known = fixture.fleet.find("b");
    ServerSpec trusted("b");
    trusted.trusted = true;
    trusted.labels = {"gpu"};
    fixture.fleet.put(trusted);
    BOOST_TEST(fixture.listener.told() == "~b .");
    BOOST_TEST(fixture.fleet.find("b") == known);
    BOOST_TEST((known->spec == trusted));
    fixture.fleet.put(trusted, "c"); // as it is, and where it is
    fixture.fleet.put(trusted);
    BOOST_TEST(fixture.listener.told() == "");
    fixture.fleet.put(trusted, "a");
    BOOST_TEST(fixture.listener.told() == "~b<a .");
    BOOST_TEST(fixture.order() == "b a c d");
    fixture.fleet.remove("a");
    fixture.fleet.remove("a");
    BOOST_TEST(fixture.listener.told() == "-a .");
    BOOST_TEST(!fixture.fleet.find("a"));
    BOOST_TEST(fixture.order() == "b c d");
}

BOOST_AUTO_TEST_CASE(of_a_list_that_is_set_only_what_differs_is_told)
{
    Fixture fixture({"a", "b", "c"});
    fixture.fleet.set(specs({"a", "b", "c"}));
    BOOST_TEST(fixture.listener.told() == "");
    auto servers = specs({"a", "b", "d"});
    servers[1].weight = 2;
    fixture.fleet.set(servers);
    BOOST_TEST(fixture.listener.told() == "-c ~b< +d< .");
    BOOST_TEST(fixture.order() == "a b d");
    fixture.fleet.set(specs({"d", "a"}));
    BOOST_TEST(fixture.order() == "d a");
    BOOST_TEST(fixture.listener.told() == "-b ~d<a .");
    fixture.fleet.set({});
    BOOST_TEST(fixture.order() == "");
    BOOST_TEST(fixture.listener.told() == "-d -a .");
}

BOOST_AUTO_TEST_CASE(of_a_machine_that_is_listed_twice_the_first_entry_counts)
{
    Fixture fixture({});
    auto servers = specs({"a", "b", "a"});
    servers[0].weight = 2;
    fixture.fleet.set(servers);
    BOOST_TEST(fixture.order() == "a b");
    BOOST_TEST(fixture.fleet.find("a")->spec.weight == 2);
    BOOST_TEST(fixture.listener.told() == "+a< +b< .");
}

BOOST_AUTO_TEST_CASE(changes_are_carried_out_one_after_the_other)
{
    using enum ServerChange::Kind;
    Fixture fixture({"a", "c"});
    fixture.fleet.change({change_of(added, "b", "c"), change_of(removed, "a"), change_of(removed, "x"),
                          change_of(changed, "c", "b"), change_of(added, "d")});
    BOOST_TEST(fixture.listener.told() == "+b<c -a ~c<b +d< .");
    BOOST_TEST(fixture.order() == "c b d");
}

BOOST_AUTO_TEST_CASE(what_was_found_is_known_by_who_named_it)
{
    Fixture fixture({"a"});
    auto change = change_of(ServerChange::Kind::added, "10.0.0.2:2000");
    change.server.found_by = "dns:sim.test:2000";
    fixture.fleet.change({change});
    BOOST_TEST(fixture.fleet.find("10.0.0.2:2000")->spec.found_by == "dns:sim.test:2000");
    change.server.found_by = "announced";
    fixture.fleet.change({change});
    BOOST_TEST(fixture.listener.told() == "+10.0.0.2:2000< . ~10.0.0.2:2000< .");
    BOOST_TEST(fixture.fleet.find("10.0.0.2:2000")->spec.found_by == "announced");
}

BOOST_AUTO_TEST_CASE(a_machine_is_drained_until_that_is_taken_back)
{
    Fixture fixture({"a"});
    BOOST_TEST(fixture.fleet.find("a")->drained_by() == "");
    BOOST_TEST(fixture.fleet.drain("a", true));
    BOOST_TEST(fixture.fleet.drain("a", true));
    BOOST_TEST(fixture.listener.told() == "~a (>operator) .");
    BOOST_TEST(fixture.fleet.drained() == 1u);
    BOOST_TEST(fixture.fleet.find("a")->is_draining());
    BOOST_TEST(fixture.fleet.drain("a", false));
    BOOST_TEST(fixture.listener.told() == "~a (operator>) .");
    BOOST_TEST(!fixture.fleet.find("a")->is_draining());
    BOOST_TEST(fixture.fleet.drained() == 0u);
    BOOST_TEST(!fixture.fleet.drain("b", true));
    BOOST_TEST(!fixture.fleet.drain("b", false));
    BOOST_TEST(fixture.fleet.drained() == 0u);
    BOOST_TEST(fixture.listener.told() == "");
}

BOOST_AUTO_TEST_CASE(what_the_configuration_drains_stays_drained)
{
    Fixture fixture({});
    ServerSpec drained("b");
    drained.drain = true;
    fixture.fleet.put(drained);
    BOOST_TEST(fixture.fleet.find("b")->drained_by() == "configuration");
    BOOST_TEST(fixture.fleet.drain("b", true));
    BOOST_TEST(fixture.fleet.find("b")->drained_by() == "operator");
    BOOST_TEST(fixture.fleet.drain("b", false));
    BOOST_TEST(fixture.fleet.find("b")->drained_by() == "configuration");
    BOOST_TEST(fixture.fleet.find("b")->is_draining());
}

// SIGHUP.
BOOST_AUTO_TEST_CASE(it_stays_drained_over_another_list_but_not_once_it_has_left)
{
    Fixture fixture({"a", "b"});
    (void)fixture.fleet.drain("a", true);
    auto servers = specs({"b", "a"});
    servers[1].weight = 2;
    fixture.fleet.set(servers);
    BOOST_TEST(fixture.fleet.find("a")->drained_by() == "operator");
    BOOST_TEST(fixture.fleet.find("a")->spec.weight == 2);
    fixture.fleet.set(specs({"b"}));
    BOOST_TEST(fixture.fleet.drained() == 0u);
    fixture.fleet.set(specs({"a"}));
    BOOST_TEST(fixture.fleet.find("a")->drained_by() == "");
}

BOOST_AUTO_TEST_CASE(who_follows_is_told_of_all_machines_and_in_the_order_of_following)
{
    Fixture fixture({"a", "b"});
    Listener second("2");
    second.write_with(fixture.listener);
    fixture.fleet.add_observer(second);
    fixture.fleet.add_observer(second);
    BOOST_TEST(fixture.listener.told() == "2+a< 2+b< 2.");
    fixture.fleet.put(ServerSpec("c"));
    BOOST_TEST(fixture.listener.told() == "+c< 2+c< . 2.");
    fixture.fleet.remove("c");
    BOOST_TEST(fixture.listener.told() == "2-c -c . 2.");
    fixture.fleet.remove_observer(second);
    fixture.fleet.remove("b");
    BOOST_TEST(fixture.listener.told() == "-b .");
}

BOOST_AUTO_TEST_CASE(a_fleet_and_its_observers_end_in_any_order)
{
    auto fleet = std::make_unique<Fleet>();
    Listener listener;
    {
        Listener shorter;
        fleet->add_observer(shorter);
        fleet->add_observer(listener);
    }
    fleet->put(ServerSpec("a"));
    BOOST_TEST(listener.told() == "+a< .");
    Fleet other;
    other.add_observer(listener);
    fleet->put(ServerSpec("b"));
    BOOST_TEST(listener.told() == "");
    fleet->add_observer(listener);
    fleet.reset();
    other.add_observer(listener);
    other.put(ServerSpec("c"));
    BOOST_TEST(listener.told() == "+a< +b< . +c< .");
}

BOOST_AUTO_TEST_CASE(only_machines_that_are_reached_inside_alone_have_a_path)
{
    Fleet fleet([](std::string_view message) { return std::string(message); });
    ServerSpec server("10.0.0.2:2000");
    server.has_own_path = true;
    fleet.put(server);
    BOOST_TEST(fleet.find("10.0.0.2:2000")->path == "");
    server.internal_address = "10.0.0.2:2000";
    fleet.put(server);
    BOOST_TEST(fleet.find("10.0.0.2:2000")->path.starts_with(core::machine_folder));
    server.has_own_path = false;
    fleet.put(server);
    BOOST_TEST(fleet.find("10.0.0.2:2000")->path == "");
}

BOOST_AUTO_TEST_CASE(a_scheduler_that_follows_places_on_its_machines_but_drained_ones)
{
    constexpr TimePoint now(std::chrono::hours(1));
    Fleet fleet;
    fleet.set(specs({"a", "b"}));
    Scheduler scheduler;
    scheduler.follow(fleet);
    auto followed = std::move(scheduler); // what follows is what it is, wherever it is kept
    for (auto const* address : {"a", "b"}) {
        LoadEvent event;
        event.server.address = address;
        event.server.state = ServerState::up;
        event.server.report.load = 10;
        followed.take(event, now);
    }
    (void)fleet.drain("a", true);
    BOOST_TEST(followed.place(now)->address == "b");
    BOOST_TEST((followed.refusal_of("a", now) == Refusal::draining));
    LoadEvent lost;
    lost.server.address = "b";
    lost.server.state = ServerState::down;
    followed.take(lost, now);
    BOOST_TEST((followed.refusal_of("b", now) == Refusal::lost));
    (void)fleet.drain("a", false);
    BOOST_TEST(followed.place(now)->address == "a");
    fleet.remove("a");
    BOOST_TEST((followed.refusal_of("a", now) == Refusal::unknown));
}

BOOST_AUTO_TEST_SUITE_END()
