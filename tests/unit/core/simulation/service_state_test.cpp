#include "unit_test.hpp"

#include "core/simulation/service_state.hpp"

using webots_cloud::core::ServiceState;

BOOST_AUTO_TEST_SUITE(service_state)

BOOST_AUTO_TEST_CASE(a_server_takes_simulations_until_it_is_drained_and_again_when_it_serves)
{
    ServiceState state;
    BOOST_TEST(!state.is_draining());
    for (bool const exit_when_empty : {false, true}) {
        state.drain(exit_when_empty);
        BOOST_TEST(state.is_draining());
        state.serve();
        BOOST_TEST(!state.is_draining());
    }
}

BOOST_AUTO_TEST_CASE(it_ends_with_the_last_simulation_only_when_that_was_the_last_request)
{
    ServiceState state;
    BOOST_TEST(!state.has_finished(0));
    state.drain(false);
    BOOST_TEST(!state.has_finished(0));
    state.drain(true);
    BOOST_TEST(!state.has_finished(1));
    BOOST_TEST(state.has_finished(0));
    state.drain(false);
    BOOST_TEST(!state.has_finished(0));
    state.drain(true);
    state.serve();
    BOOST_TEST(!state.has_finished(0));
}

BOOST_AUTO_TEST_CASE(a_server_that_stops_is_as_drained_as_it_was)
{
    ServiceState state;
    BOOST_TEST(!state.is_stopping());
    state.stop();
    BOOST_TEST(state.is_stopping());
    BOOST_TEST(!state.is_draining());
    state.drain(false);
    BOOST_TEST(state.is_stopping());
    BOOST_TEST(state.is_draining());
}

BOOST_AUTO_TEST_SUITE_END()
