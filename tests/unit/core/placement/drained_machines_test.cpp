#include "unit_test.hpp"

#include "core/placement/drained_machines.hpp"

using namespace webots_cloud;
using namespace webots_cloud::placement;

// Protocol section 13.4.
BOOST_AUTO_TEST_SUITE(drained_machines)

using Outcome = DrainedMachines::Outcome;

namespace {

DrainOrder order(std::string machine, bool off = false)
{
    DrainOrder order;
    order.machine = std::move(machine);
    order.off = off;
    return order;
}

/// `a:1`, and `b/2`, which the configuration drains.
DrainedMachines two_machines()
{
    ServerSpec drained("b/2");
    drained.drain = true;
    DrainedMachines machines;
    machines.put(ServerSpec("a:1"));
    machines.put(drained);
    return machines;
}

} // namespace

BOOST_AUTO_TEST_CASE(an_order_names_one_machine)
{
    BOOST_TEST((parse_drain_order("machine=sim1:2000") == order("sim1:2000")));
    BOOST_TEST((parse_drain_order("machine=%2A%2F2000&off") == order("*/2000", true)));
    BOOST_TEST((parse_drain_order("off&machine=a:1") == order("a:1", true)));
    for (auto const* query :
         {"", "machine", "machine=", "machine=%", "machine=%2", "off", "off&machine=", "machine=a:1&on",
          "machine=a:1&off&off", "machine=a:1&machine=b:1", "machine=a:1&", "machines=a:1", "exit"})
        BOOST_TEST(!parse_drain_order(query), query);
}

BOOST_AUTO_TEST_CASE(a_machine_is_drained_until_that_is_taken_back)
{
    auto machines = two_machines();
    BOOST_TEST(machines.drained_by("a:1") == "");
    BOOST_TEST((machines.obey(order("a:1")) == Outcome::done));
    BOOST_TEST((machines.obey(order("a:1")) == Outcome::done));
    BOOST_TEST(machines.drained_by("a:1") == "operator");
    BOOST_TEST(machines.count() == 1u);
    BOOST_TEST(machines.treated("a:1").drain);
    BOOST_TEST((machines.obey(order("a:1", true)) == Outcome::done));
    BOOST_TEST(machines.drained_by("a:1") == "");
    BOOST_TEST(!machines.treated("a:1").drain);
    BOOST_TEST(machines.count() == 0u);
}

BOOST_AUTO_TEST_CASE(what_the_configuration_drains_stays_drained)
{
    auto machines = two_machines();
    BOOST_TEST(machines.drained_by("b/2") == "configuration");
    BOOST_TEST((machines.obey(order("b/2")) == Outcome::done));
    BOOST_TEST(machines.drained_by("b/2") == "operator");
    BOOST_TEST((machines.obey(order("b/2", true)) == Outcome::configured));
    BOOST_TEST(machines.drained_by("b/2") == "configuration");
    BOOST_TEST(machines.treated("b/2").drain);
}

BOOST_AUTO_TEST_CASE(a_machine_that_is_not_listed_is_not_drained)
{
    auto machines = two_machines();
    BOOST_TEST((machines.obey(order("c:3")) == Outcome::unknown));
    BOOST_TEST((machines.obey(order("c:3", true)) == Outcome::unknown));
    BOOST_TEST(machines.drained_by("c:3") == "");
    BOOST_TEST(machines.count() == 0u);
}

// SIGHUP.
BOOST_AUTO_TEST_CASE(it_outlives_another_entry_but_not_the_machines_leaving)
{
    auto machines = two_machines();
    (void)machines.obey(order("a:1"));
    machines.put(ServerSpec("a:1"));
    BOOST_TEST(machines.drained_by("a:1") == "operator");
    machines.remove("a:1");
    machines.remove("a:1");
    BOOST_TEST(machines.count() == 0u);
    machines.put(ServerSpec("a:1"));
    BOOST_TEST(machines.drained_by("a:1") == "");
}

BOOST_AUTO_TEST_SUITE_END()
