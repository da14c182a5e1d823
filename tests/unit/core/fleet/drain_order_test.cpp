#include "unit_test.hpp"

#include "core/fleet/drain_order.hpp"

using namespace webots_cloud;

// Protocol section 13.4.
BOOST_AUTO_TEST_SUITE(drain_order)

namespace {

core::DrainOrder order(std::string machine, bool off = false)
{
    core::DrainOrder order;
    order.machine = std::move(machine);
    order.off = off;
    return order;
}

} // namespace

BOOST_AUTO_TEST_CASE(an_order_names_one_machine)
{
    using core::parse_drain_order;
    BOOST_TEST((parse_drain_order("machine=sim1:2000") == order("sim1:2000")));
    BOOST_TEST((parse_drain_order("machine=%2A%2F2000&off") == order("*/2000", true)));
    BOOST_TEST((parse_drain_order("off&machine=a:1") == order("a:1", true)));
    for (auto const* query :
         {"", "machine", "machine=", "machine=%", "machine=%2", "off", "off&machine=", "machine=a:1&on",
          "machine=a:1&off&off", "machine=a:1&machine=b:1", "machine=a:1&", "machines=a:1", "exit"})
        BOOST_TEST(!parse_drain_order(query), query);
}

BOOST_AUTO_TEST_SUITE_END()
