#include "unit_test.hpp"

#include "core/relay/machine_faults.hpp"
#include "core/text.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(machine_faults)

namespace {

TimePoint at(Duration time)
{
    return TimePoint(time);
}

} // namespace

BOOST_AUTO_TEST_CASE(a_silent_machine_rests_for_longer_each_time_and_a_minute_at_most)
{
    MachineFaults faults;
    auto now = at(0s);
    for (auto const pause : {10s, 20s, 40s, 60s, 60s}) {
        faults.was_silent("a", now);
        BOOST_TEST(faults.silent(now + pause - 1ms).size() == 1u);
        BOOST_TEST(faults.silent(now + pause).empty());
        now += pause;
    }
    faults.has_served("a");
    faults.was_silent("a", now);
    BOOST_TEST(faults.silent(now + 10s).empty());
}

BOOST_AUTO_TEST_CASE(four_groups_that_were_refused_in_turn_make_a_machine_the_last)
{
    MachineFaults faults;
    for (int i = 0; i < 10; ++i)
        faults.has_refused("a", "one address", "The disk is full.");
    faults.has_refused("a", "another", "The disk is full.");
    faults.has_refused("a", "a third", "The disk is full.");
    BOOST_TEST(faults.unwilling().empty());
    faults.has_refused("a", "a fourth", "This world is not allowed.");
    BOOST_TEST(faults.unwilling() == std::vector<std::string>{"a"}, boost::test_tools::per_element());
    BOOST_TEST(faults.silent(at(0s)).empty());
    BOOST_TEST(faults.last_refusal("a") == "This world is not allowed.");
    BOOST_TEST(faults.last_refusal("b") == "");
    faults.has_served("a");
    BOOST_TEST(faults.last_refusal("a") == "");
    BOOST_TEST(faults.unwilling().empty());
}

// A home of IPv6 has 256 or 65,536 networks that look like clients.
BOOST_AUTO_TEST_CASE(no_network_makes_a_machine_the_last_alone)
{
    MachineFaults faults;
    for (int i = 0; i < 256; ++i) {
        auto const number = std::string{"0123456789abcdef"[i / 16], "0123456789abcdef"[i % 16]};
        faults.has_refused("a", concat("2001:db8:1:", number, "00::/64"), "No."); // of one /48
        faults.has_refused("b", concat("2001:db8:1:", number, "::/64"), "No.");   // of one /56
        faults.has_refused("c", "", "No.");                                       // nobody's
    }
    BOOST_TEST(faults.unwilling().empty());
    BOOST_TEST(faults.last_refusal("c") == "No.");
    for (auto const* machine : {"a", "b", "c"})
        faults.has_refused(machine, "203.0.113.7", "No.");
    BOOST_TEST(faults.unwilling() == std::vector<std::string>{"a"}, boost::test_tools::per_element());
    faults.has_refused("b", "203.0.113.8", "No.");
    BOOST_TEST(faults.unwilling() == (std::vector<std::string>{"a", "b"}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(machines_that_have_left_the_list_are_forgotten)
{
    MachineFaults faults;
    faults.was_silent("a", at(0s));
    faults.was_silent("b", at(0s));
    faults.forget("a");
    faults.forget("c");
    BOOST_TEST(faults.silent(at(0s)) == std::vector<std::string>{"b"}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_SUITE_END()
