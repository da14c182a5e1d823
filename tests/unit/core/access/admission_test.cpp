#include "unit_test.hpp"

#include "core/access/admission.hpp"

#include <list>

using namespace webots_cloud;
using core::Admission;

BOOST_TEST_DONT_PRINT_LOG_VALUE(Admission::Verdict)

BOOST_AUTO_TEST_SUITE(admission)

using Verdict = Admission::Verdict;

namespace {

core::AdmissionLimits limits(int simulations)
{
    core::AdmissionLimits limits;
    limits.max_simulations = simulations;
    limits.max_silent = 3;
    limits.silent_per_address = 2;
    return limits;
}

struct Limited : Admission
{
    Limited(int simulations, std::size_t per_address) : Admission(limits(simulations))
    {
        set_simulations_per_address(per_address);
    }
};

} // namespace

BOOST_AUTO_TEST_CASE(the_machine_is_full_before_a_client_is)
{
    Limited admission(3, 2);
    std::list<Admission::Place> places(4);
    auto place = places.begin();
    BOOST_TEST(admission.admit("a", "", *place++) == Verdict::admitted);
    BOOST_TEST(admission.admit("a", "", *place++) == Verdict::admitted);
    BOOST_TEST(admission.admit("a", "", *place) == Verdict::client_full_first);
    BOOST_TEST(admission.admit("a", "", *place) == Verdict::client_full);
    BOOST_TEST(!admission.is_full()); // a refused client takes no place
    BOOST_TEST(admission.admit("b", "", *place++) == Verdict::admitted);
    BOOST_TEST(admission.is_full());
    BOOST_TEST(admission.admit("a", "", *place) == Verdict::full);
    BOOST_TEST(admission.admit("c", "", *place) == Verdict::full);
}

BOOST_AUTO_TEST_CASE(a_place_is_given_back_once_and_can_be_had_again)
{
    Limited admission(1, 1);
    {
        Admission::Place first;
        BOOST_TEST(admission.admit("a", "", first) == Verdict::admitted);
        first.release();
        first.release();
        Admission::Place second;
        BOOST_TEST(admission.admit("a", "", second) == Verdict::admitted);
        BOOST_TEST(admission.is_full());
    }
    Admission::Place third;
    BOOST_TEST(admission.admit("a", "", third) == Verdict::admitted);
}

BOOST_AUTO_TEST_CASE(nobody_is_counted_for_the_machine_only)
{
    Limited admission(2, 1);
    std::list<Admission::Place> places(3);
    auto place = places.begin();
    BOOST_TEST(admission.admit("", "", *place++) == Verdict::admitted);
    BOOST_TEST(admission.admit("", "", *place++) == Verdict::admitted);
    BOOST_TEST(admission.admit("", "", *place) == Verdict::full);
}

BOOST_AUTO_TEST_CASE(a_new_limit_holds_for_the_next_one)
{
    Limited admission(9, 1);
    Admission::Place first;
    Admission::Place second;
    BOOST_TEST(admission.admit("a", "", first) == Verdict::admitted);
    BOOST_TEST(admission.admit("a", "", second) == Verdict::client_full_first);
    admission.set_simulations_per_address(2);
    BOOST_TEST(admission.simulations_per_address() == 2u);
    BOOST_TEST(admission.admit("a", "", second) == Verdict::admitted);
}

BOOST_AUTO_TEST_CASE(who_is_silent_takes_no_place_for_a_simulation)
{
    Limited admission(1, 1);
    BOOST_TEST(!admission.add_silent(1, "a"));
    BOOST_TEST(!admission.add_silent(2, "a"));
    BOOST_TEST((admission.add_silent(3, "a") == 1u));
    BOOST_TEST(!admission.is_full());
    admission.remove_silent(2);
    BOOST_TEST(!admission.add_silent(4, "a"));
}

BOOST_AUTO_TEST_CASE(a_world_has_its_own_limit_and_a_refused_start_takes_nothing_of_it)
{
    Limited admission(3, 1);
    admission.set_simulations_per_world(1);
    Admission::Place first;
    Admission::Place second;
    Admission::Place third;
    BOOST_TEST(admission.admit("a", "arena", first) == Verdict::admitted);
    BOOST_TEST(admission.admit("b", "arena", second) == Verdict::world_full);
    BOOST_TEST(admission.admit("a", "maze", second) == Verdict::client_full_first);
    BOOST_TEST(admission.admit("b", "maze", second) == Verdict::admitted);
    BOOST_TEST(admission.admit("c", "", third) == Verdict::admitted);
    first.release();
    Admission::Place fourth;
    BOOST_TEST(admission.admit("d", "arena", fourth) == Verdict::admitted);
}

BOOST_AUTO_TEST_SUITE_END()
