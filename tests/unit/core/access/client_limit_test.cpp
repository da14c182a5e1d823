#include "unit_test.hpp"

#include "core/access/client_limit.hpp"

#include <vector>

using namespace webots_cloud;
using core::ClientLimit;

BOOST_TEST_DONT_PRINT_LOG_VALUE(ClientLimit::Verdict)

BOOST_AUTO_TEST_SUITE(client_limit)

using Verdict = ClientLimit::Verdict;

BOOST_AUTO_TEST_CASE(each_client_has_a_limit_of_its_own_and_room_again_when_something_ends)
{
    ClientLimit limit(2);
    std::vector<ClientLimit::Ticket> tickets(4);
    BOOST_TEST(limit.admit("a", tickets[0]) == Verdict::admitted);
    BOOST_TEST(limit.admit("a", tickets[1]) == Verdict::admitted);
    BOOST_TEST(limit.admit("a", tickets[2]) == Verdict::refused_first);
    BOOST_TEST(limit.admit("a", tickets[2]) == Verdict::refused);
    BOOST_TEST(limit.admit("b", tickets[2]) == Verdict::admitted);
    tickets[0].release();
    tickets[0].release(); // the second release is ignored
    BOOST_TEST(limit.admit("a", tickets[3]) == Verdict::admitted);
    BOOST_TEST(limit.admit("a", tickets[0]) == Verdict::refused);
    tickets.clear();
    BOOST_TEST(limit.clients() == 0u);
    tickets.resize(2);
    BOOST_TEST(limit.admit("a", tickets[0]) == Verdict::admitted);
    BOOST_TEST(limit.admit("a", tickets[1]) == Verdict::admitted);
}

BOOST_AUTO_TEST_CASE(a_client_that_had_nothing_in_between_is_told_again)
{
    ClientLimit limit(1);
    for (int i = 0; i < 2; ++i) {
        ClientLimit::Ticket one;
        ClientLimit::Ticket other;
        BOOST_TEST(limit.admit("a", one) == Verdict::admitted);
        BOOST_TEST(limit.admit("a", other) == Verdict::refused_first);
        BOOST_TEST(limit.admit("a", other) == Verdict::refused);
    }
}

BOOST_AUTO_TEST_CASE(tickets_are_moved_and_replaced_without_losing_count)
{
    ClientLimit limit(1);
    ClientLimit::Ticket first;
    BOOST_TEST(limit.admit("a", first) == Verdict::admitted);
    ClientLimit::Ticket second(std::move(first));
    first = ClientLimit::Ticket();
    BOOST_TEST(limit.clients() == 1u);
    BOOST_TEST(limit.admit("b", second) ==
               Verdict::admitted); // makes room for it by giving up the oldest of a
    BOOST_TEST(limit.clients() == 1u);
    BOOST_TEST(limit.admit("a", first) == Verdict::admitted);
    first = std::move(second);
    BOOST_TEST(limit.clients() == 1u);
    BOOST_TEST(limit.admit("", first) == Verdict::admitted);
    BOOST_TEST(limit.clients() == 0u);
}

BOOST_AUTO_TEST_CASE(nobody_and_a_limit_of_0_are_not_counted_against_anybody)
{
    ClientLimit limit(1);
    std::vector<ClientLimit::Ticket> tickets(5);
    for (auto& ticket : tickets)
        BOOST_TEST(limit.admit("", ticket) == Verdict::admitted);
    limit.set_max(0);
    for (auto& ticket : tickets)
        BOOST_TEST(limit.admit("a", ticket) == Verdict::admitted);
}

BOOST_AUTO_TEST_CASE(a_lower_limit_takes_nothing_away)
{
    ClientLimit limit(0);
    std::vector<ClientLimit::Ticket> tickets(3);
    for (auto& ticket : tickets)
        (void)limit.admit("a", ticket);
    limit.set_max(2);
    ClientLimit::Ticket more;
    BOOST_TEST(limit.admit("a", more) == Verdict::refused_first);
    tickets.pop_back();
    BOOST_TEST(limit.admit("a", more) == Verdict::refused);
    tickets.pop_back();
    BOOST_TEST(limit.admit("a", more) == Verdict::admitted);
}

BOOST_AUTO_TEST_SUITE_END()
