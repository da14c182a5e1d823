#include "unit_test.hpp"

#include "core/simulation/port_pool.hpp"

using namespace webots_cloud;

// Protocol section 4.3 and quirk Q9.
BOOST_AUTO_TEST_SUITE(port_pool)

BOOST_AUTO_TEST_CASE(the_lowest_free_port_is_lent_and_comes_back)
{
    core::PortPool pool(2001, 3);
    auto const any = [](std::uint16_t) { return true; };
    BOOST_TEST(pool.acquire(any).value() == 2001);
    BOOST_TEST(pool.acquire(any).value() == 2002);
    pool.release(2001);
    BOOST_TEST(pool.acquire(any).value() == 2001);
    BOOST_TEST(pool.lent() == 2u);
}

BOOST_AUTO_TEST_CASE(ports_that_somebody_else_has_are_skipped)
{
    core::PortPool pool(2001, 3);
    BOOST_TEST(pool.acquire([](std::uint16_t port) { return port == 2003; }).value() == 2003);
}

BOOST_AUTO_TEST_CASE(exhaustion_is_said_in_the_words_operators_know)
{
    core::PortPool pool(2001, 1);
    auto const any = [](std::uint16_t) { return true; };
    BOOST_TEST(pool.acquire(any).has_value());
    auto const full = pool.acquire(any);
    BOOST_TEST((full.error() == errc::unavailable));
    BOOST_TEST(full.error().message() ==
               "Too many open connections (>1): this simulation server is full. Please try again later.");
}

BOOST_AUTO_TEST_CASE(the_range_ends_with_the_last_port_there_is)
{
    core::PortPool pool(65535, 10);
    auto const any = [](std::uint16_t) { return true; };
    BOOST_TEST(pool.acquire(any).value() == 65535);
    BOOST_TEST(!pool.acquire(any));
}

BOOST_AUTO_TEST_SUITE_END()
