#include "unit_test.hpp"

#include "core/access/silent_clients.hpp"

using namespace webots_cloud;
using core::SilentClients;

BOOST_AUTO_TEST_SUITE(silent_clients)

namespace {

constexpr std::uint64_t nobody = 0;

/// Who is closed when `id` enters; `nobody` when all may stay.
std::uint64_t enter(SilentClients& clients, std::uint64_t id, std::string const& client)
{
    return clients.enter(id, client).value_or(nobody);
}

} // namespace

BOOST_AUTO_TEST_CASE(who_has_waited_longest_makes_room_for_who_comes)
{
    SilentClients clients(3, 3);
    for (std::uint64_t id = 1; id <= 3; ++id)
        BOOST_TEST(enter(clients, id, "a" + std::to_string(id)) == nobody);
    BOOST_TEST(clients.first().value() == 1u);
    BOOST_TEST(enter(clients, 4, "b") == 1u);
    BOOST_TEST(clients.first().value() == 2u);
    BOOST_TEST(clients.leave(3) == "a3");
    BOOST_TEST(clients.leave(3) == "");
    BOOST_TEST(clients.leave(1) == "");
    BOOST_TEST(enter(clients, 5, "c") == nobody);
    BOOST_TEST(enter(clients, 6, "d") == 2u);
    BOOST_TEST(clients.size() == 3u);
    BOOST_TEST(!SilentClients(1, 1).first());
}

BOOST_AUTO_TEST_CASE(a_client_with_too_many_makes_room_for_itself)
{
    SilentClients clients(5, 2);
    BOOST_TEST(enter(clients, 1, "other") == nobody);
    BOOST_TEST(enter(clients, 2, "greedy") == nobody);
    BOOST_TEST(enter(clients, 3, "greedy") == nobody);
    BOOST_TEST(enter(clients, 4, "greedy") == 2u);
    BOOST_TEST(enter(clients, 5, "greedy") == 3u);
    BOOST_TEST(clients.size() == 3u);
    clients.leave(4);
    BOOST_TEST(enter(clients, 6, "greedy") == nobody);
}

BOOST_AUTO_TEST_CASE(those_that_nobody_can_tell_apart_share_the_whole_list)
{
    SilentClients clients(4, 1);
    for (std::uint64_t id = 1; id <= 4; ++id)
        BOOST_TEST(enter(clients, id, "") == nobody);
    BOOST_TEST(enter(clients, 5, "") == 1u);
    BOOST_TEST(enter(clients, 6, "a") == 2u);
}

BOOST_AUTO_TEST_CASE(however_many_come_the_list_stays_short)
{
    SilentClients clients(256, 64);
    std::uint64_t sent_away = 0;
    for (std::uint64_t id = 1; id <= 10'000; ++id)
        sent_away += enter(clients, id, "2001:db8:" + std::to_string(id % 1000) + "::/64") == nobody ? 0 : 1;
    BOOST_TEST(clients.size() == 256u);
    BOOST_TEST(sent_away == 10'000u - 256u);
}

BOOST_AUTO_TEST_SUITE_END()
