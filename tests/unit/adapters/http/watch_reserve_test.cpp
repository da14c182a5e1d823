#include "unit_test.hpp"

#include "adapters/http/watch_reserve.hpp"

using namespace webots_cloud::adapters;

BOOST_AUTO_TEST_SUITE(watch_reserve)

BOOST_AUTO_TEST_CASE(one_that_is_let_go_of_is_taken_back_when_it_is_free)
{
    WatchReserve reserve;
    reserve.fill();
    BOOST_TEST(!reserve.is_short());
    BOOST_TEST(reserve.find_free());
    BOOST_TEST(reserve.is_short());
    BOOST_TEST(reserve.find_free()); // of those that nobody has
    reserve.refill();
    BOOST_TEST(!reserve.is_short());
}

BOOST_AUTO_TEST_CASE(a_server_without_a_reserve_has_none_to_let_go_of)
{
    WatchReserve reserve;
    BOOST_TEST(!reserve.is_short());
    BOOST_TEST(!reserve.find_free());
    reserve.refill();
    BOOST_TEST(!reserve.is_short());
}

BOOST_AUTO_TEST_SUITE_END()
