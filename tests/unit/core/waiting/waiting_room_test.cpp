#include "unit_test.hpp"

#include "core/waiting/waiting_room.hpp"

#include <algorithm>
#include <chrono>
#include <random>
#include <string>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::WaitingRoom;
using core::WaitingRoomParams;
using Verdict = core::WaitingRoom::Verdict;

namespace {

constexpr WallTime noon{std::chrono::hours(400'000)};

WaitingRoom room_of(std::size_t places)
{
    WaitingRoomParams params;
    params.places = places;
    return WaitingRoom(params);
}

std::vector<WaitingRoom::Id> line_of(WaitingRoom const& room)
{
    std::vector<WaitingRoom::Id> ids;
    room.visit([&](WaitingRoom::Id id, std::size_t ahead) {
        BOOST_TEST(ahead == ids.size());
        ids.push_back(id);
        return true;
    });
    return ids;
}

std::string group(int number)
{
    return "203.0.113." + std::to_string(number);
}

} // namespace

BOOST_TEST_DONT_PRINT_LOG_VALUE(Verdict)

// Issue 22, item 3.
BOOST_AUTO_TEST_SUITE(waiting_room)

BOOST_AUTO_TEST_CASE(who_comes_first_is_first)
{
    WaitingRoom room;
    BOOST_TEST(!room.first());
    BOOST_TEST(room.enter(7, group(1), 0, noon) == Verdict::waits);
    BOOST_TEST(room.enter(3, group(2), 0, noon + 1s) == Verdict::waits);
    BOOST_TEST(room.enter(5, group(3), 0, noon + 1s) == Verdict::waits);
    BOOST_TEST(line_of(room) == (std::vector<WaitingRoom::Id>{7, 3, 5}), boost::test_tools::per_element());
    BOOST_TEST(room.first().value() == 7u);
    BOOST_TEST(room.ahead_of(7) == 0u);
    BOOST_TEST(room.ahead_of(5) == 2u);
    BOOST_TEST(room.leave(7));
    BOOST_TEST(!room.leave(7));
    BOOST_TEST(room.first().value() == 3u);
    BOOST_TEST(room.ahead_of(5) == 1u);
    BOOST_TEST(room.size() == 2u);
}

BOOST_AUTO_TEST_CASE(each_seat_that_a_group_has_or_waits_for_makes_it_come_later)
{
    WaitingRoom room;
    room.enter(1, group(1), 2, noon);
    BOOST_TEST((room.rank(1) == noon + 20s));
    room.enter(2, group(1), 2, noon + 1s);
    BOOST_TEST((room.rank(2) == noon + 1s + 30s));
    room.enter(3, group(2), 0, noon + 15s);
    BOOST_TEST(room.first().value() == 3u, "another group is not late");
    room.leave(1);
    room.enter(4, group(1), 0, noon + 2s);
    BOOST_TEST((room.rank(4) == room.rank(2)), "who has left counts no more, but a group keeps its order");
    BOOST_TEST((room.rank(2) == noon + 31s), "a rank never changes");
    BOOST_TEST(room.size_of(group(1)) == 2u);
    BOOST_TEST(room.size_of(group(9)) == 0u);
}

BOOST_AUTO_TEST_CASE(a_group_is_served_in_the_order_of_arrival_although_it_has_less_by_now)
{
    WaitingRoom room;
    WallTime const noon{};
    for (WaitingRoom::Id id = 1; id <= 3; ++id)
        (void)room.enter(id, "class", 10, noon); // ranks of 100 to 120 s
    room.leave(1);
    room.leave(2);
    (void)room.enter(4, "class", 0, noon + 1s); // 11 s, if it were alone
    BOOST_TEST(*room.first() == 3u);
    BOOST_TEST((room.rank(4) == room.rank(3)));
    room.leave(3);
    room.leave(4);
    (void)room.enter(5, "class", 0, noon + 2s);
    BOOST_TEST((room.rank(5) == noon + 2s));
}

BOOST_AUTO_TEST_CASE(the_penalty_has_a_limit)
{
    WaitingRoom room;
    for (auto const& [held, later] : {std::pair<std::size_t, Duration>(29, 290s),
                                      {30, 5min},
                                      {31, 5min},
                                      {static_cast<std::size_t>(-2), 5min}}) {
        room.enter(1, group(1), held, noon);
        BOOST_TEST((room.rank(1) == noon + later));
        room.leave(1);
    }
    WaitingRoomParams params;
    params.seat_penalty = 7s; // not a divisor
    room.apply(params);
    room.enter(1, group(1), 43, noon);
    BOOST_TEST((room.rank(1) == noon + 5min));
    params.seat_penalty = 0s;
    room.apply(params);
    room.enter(2, group(2), 43, noon);
    BOOST_TEST((room.rank(2) == noon));
    BOOST_TEST((room.rank(1) == noon + 5min));
}

BOOST_AUTO_TEST_CASE(who_belongs_to_no_group_shares_no_penalty_and_no_limit)
{
    auto room = room_of(200);
    for (WaitingRoom::Id id = 0; id < 200; ++id) {
        BOOST_TEST(room.enter(id, "", 0, noon) == Verdict::waits);
        BOOST_TEST((room.rank(id) == noon));
    }
    BOOST_TEST(room.size_of("") == 0u);
}

BOOST_AUTO_TEST_CASE(a_full_room_refuses)
{
    auto room = room_of(2);
    BOOST_TEST(room.enter(1, group(1), 0, noon) == Verdict::waits);
    BOOST_TEST(room.return_to(2, group(1), noon) == Verdict::waits);
    BOOST_TEST(room.is_full());
    BOOST_TEST(room.enter(3, group(2), 0, noon) == Verdict::full);
    BOOST_TEST(room.return_to(4, group(2), noon) == Verdict::waits, "it had a place before");
    BOOST_TEST(room.leave(4));
    BOOST_TEST(room.size() == 2u);
    BOOST_TEST(room.leave(1));
    BOOST_TEST(room.enter(3, group(2), 0, noon) == Verdict::waits);
    BOOST_TEST(room_of(0).is_full());
}

BOOST_AUTO_TEST_CASE(one_group_never_fills_the_room)
{
    for (auto const& [places, most] :
         {std::pair<std::size_t, std::size_t>(1000, 250), {164, 41}, {100, 40}, {40, 40}, {12, 12}}) {
        auto room = room_of(places);
        BOOST_TEST(room.group_places() == most);
        for (WaitingRoom::Id id = 0; id < most; ++id)
            BOOST_TEST(room.enter(id, group(1), 0, noon) == Verdict::waits);
        auto const refused = most == places ? Verdict::full : Verdict::group_full;
        BOOST_TEST(room.enter(5000, group(1), 0, noon) == refused);
        BOOST_TEST(room.return_to(5000, group(1), noon) == Verdict::group_full);
        room.put_back(7000, group(1), noon);
        BOOST_TEST(room.leave(7000), "a turn that led nowhere costs nobody the place");
        if (most < places)
            BOOST_TEST(room.enter(5000, group(2), 0, noon) == Verdict::waits);
        room.leave(0);
        BOOST_TEST(room.enter(6000, group(1), 0, noon) == Verdict::waits);
    }
}

BOOST_AUTO_TEST_CASE(who_returns_has_the_rank_of_before)
{
    WaitingRoom room;
    room.enter(1, group(1), 3, noon);
    auto const rank = room.rank(1);
    room.leave(1);
    room.enter(2, group(2), 0, noon + 31s);
    BOOST_TEST(room.return_to(3, group(1), rank) == Verdict::waits);
    BOOST_TEST((room.rank(3) == rank));
    BOOST_TEST(room.first().value() == 3u);
    BOOST_TEST(room.size_of(group(1)) == 1u, "and counts in its group");
}

BOOST_AUTO_TEST_CASE(fewer_places_send_nobody_away)
{
    auto room = room_of(3);
    for (WaitingRoom::Id id = 1; id <= 3; ++id)
        room.enter(id, group(static_cast<int>(id)), 0, noon);
    WaitingRoomParams params;
    params.places = 1;
    room.apply(params);
    BOOST_TEST(room.size() == 3u);
    BOOST_TEST(room.is_full());
    room.leave(1);
    BOOST_TEST(room.enter(4, group(4), 0, noon) == Verdict::full);
}

BOOST_AUTO_TEST_CASE(a_visit_can_end_early)
{
    WaitingRoom room;
    for (WaitingRoom::Id id = 1; id <= 5; ++id)
        room.enter(id, "", 0, noon);
    std::size_t visited = 0;
    room.visit([&](WaitingRoom::Id, std::size_t) { return ++visited < 2; });
    BOOST_TEST(visited == 2u);
}

BOOST_AUTO_TEST_CASE(ten_thousand_stand_in_the_order_of_their_ranks)
{
    constexpr WaitingRoom::Id count = 10'000;
    auto room = room_of(count);
    std::mt19937 random(1);
    std::vector<std::pair<WallTime, WaitingRoom::Id>> wanted;
    auto now = noon;
    for (WaitingRoom::Id id = 0; id < count; ++id) {
        now += std::chrono::milliseconds(random() % 200);
        auto const verdict = room.enter(id, group(static_cast<int>(random() % 100)), random() % 40, now);
        BOOST_REQUIRE(verdict == Verdict::waits);
        BOOST_REQUIRE((room.rank(id) >= now && room.rank(id) <= now + 5min));
        wanted.emplace_back(room.rank(id), id);
    }
    std::erase_if(wanted, [&](auto const& one) { return random() % 3 == 0 && room.leave(one.second); });
    std::sort(wanted.begin(), wanted.end());
    std::vector<WaitingRoom::Id> ids;
    for (auto const& [rank, id] : wanted)
        ids.push_back(id);
    BOOST_TEST(line_of(room) == ids, boost::test_tools::per_element());
    BOOST_TEST(room.ahead_of(ids.at(1234)) == 1234u);
    while (auto const first = room.first())
        room.leave(*first);
    for (int number = 0; number < 100; ++number)
        BOOST_TEST(room.size_of(group(number)) == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
