#include "unit_test.hpp"

#include "core/access/waiting_clients.hpp"

using namespace webots_cloud;
using core::WaitingClients;

namespace {

constexpr std::uint64_t nobody = 0;

/// Who is closed when `id` enters; `nobody` when all may stay.
std::uint64_t enter(WaitingClients& waiting, std::uint64_t id, std::string const& client)
{
    return waiting.enter(id, client).value_or(nobody);
}

} // namespace

BOOST_AUTO_TEST_SUITE(waiting_clients)

BOOST_AUTO_TEST_CASE(who_has_waited_longest_makes_room_for_who_comes)
{
    WaitingClients waiting(3, 3);
    for (std::uint64_t id = 1; id <= 3; ++id)
        BOOST_TEST(enter(waiting, id, "a" + std::to_string(id)) == nobody);
    BOOST_TEST(enter(waiting, 4, "b") == 1u);
    waiting.leave(3);
    waiting.leave(3);
    waiting.leave(1);
    BOOST_TEST(enter(waiting, 5, "c") == nobody);
    BOOST_TEST(enter(waiting, 6, "d") == 2u);
    BOOST_TEST(waiting.size() == 3u);
}

BOOST_AUTO_TEST_CASE(a_client_with_too_many_makes_room_for_itself)
{
    WaitingClients waiting(5, 2);
    BOOST_TEST(enter(waiting, 1, "other") == nobody);
    BOOST_TEST(enter(waiting, 2, "greedy") == nobody);
    BOOST_TEST(enter(waiting, 3, "greedy") == nobody);
    BOOST_TEST(enter(waiting, 4, "greedy") == 2u);
    BOOST_TEST(enter(waiting, 5, "greedy") == 3u);
    BOOST_TEST(waiting.size() == 3u);
    waiting.leave(4);
    BOOST_TEST(enter(waiting, 6, "greedy") == nobody);
}

BOOST_AUTO_TEST_CASE(those_that_nobody_can_tell_apart_share_the_whole_list)
{
    WaitingClients waiting(4, 1);
    for (std::uint64_t id = 1; id <= 4; ++id)
        BOOST_TEST(enter(waiting, id, "") == nobody);
    BOOST_TEST(enter(waiting, 5, "") == 1u);
    BOOST_TEST(enter(waiting, 6, "a") == 2u);
}

BOOST_AUTO_TEST_CASE(however_many_come_the_list_stays_short)
{
    WaitingClients waiting(256, 64);
    std::uint64_t sent_away = 0;
    for (std::uint64_t id = 1; id <= 10'000; ++id)
        sent_away += enter(waiting, id, "2001:db8:" + std::to_string(id % 1000) + "::/64") == nobody ? 0 : 1;
    BOOST_TEST(waiting.size() == 256u);
    BOOST_TEST(sent_away == 10'000u - 256u);
}

BOOST_AUTO_TEST_SUITE_END()
