#include "unit_test.hpp"

#include "core/waiting/waiting_room.hpp"

#include <algorithm>
#include <chrono>
#include <map>
#include <random>
#include <string>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::WaitingRoom;
using core::WaitingRoomParams;

BOOST_TEST_DONT_PRINT_LOG_VALUE(webots_cloud::core::WaitingRoom::Verdict)

BOOST_AUTO_TEST_SUITE(waiting_room)

using Verdict = core::WaitingRoom::Verdict;

namespace {

constexpr WallTime noon{std::chrono::hours(400'000)};

struct Customer : WaitingRoom::Customer
{
    using WaitingRoom::Customer::Customer;
};

/// A room and its customers, by their numbers.
struct Line
{
    Line() = default;
    explicit Line(std::size_t places) { room = WaitingRoom(params_of(places)); }

    static WaitingRoomParams params_of(std::size_t places)
    {
        WaitingRoomParams params;
        params.places = places;
        return params;
    }

    WaitingRoom::Customer& customer(WaitingRoom::Id id)
    {
        return customers.try_emplace(id, id).first->second;
    }

    WaitingRoom::Customer& prepare(WaitingRoom::Id id, std::string group, WallTime rank)
    {
        auto& one = customer(id);
        one.group = std::move(group);
        one.rank = rank;
        return one;
    }

    Verdict enter(WaitingRoom::Id id, std::string group, std::size_t held, WallTime arrived)
    {
        return room.enter(prepare(id, std::move(group), arrived), held);
    }

    Verdict return_to(WaitingRoom::Id id, std::string group, WallTime rank)
    {
        return room.return_to(prepare(id, std::move(group), rank));
    }

    void put_back(WaitingRoom::Id id, std::string group, WallTime rank)
    {
        room.put_back(prepare(id, std::move(group), rank));
    }

    bool leave(WaitingRoom::Id id) { return room.leave(customer(id)); }
    WallTime rank(WaitingRoom::Id id) { return customer(id).rank; }
    std::size_t ahead_of(WaitingRoom::Id id) { return room.ahead_of(customer(id)); }
    WaitingRoom::Id first() const { return room.at(0).id; }

    std::vector<WaitingRoom::Id> ids() const
    {
        std::vector<WaitingRoom::Id> all;
        for (std::size_t ahead = 0; ahead < room.size(); ++ahead)
            all.push_back(room.at(ahead).id);
        return all;
    }

    std::map<WaitingRoom::Id, Customer> customers;
    WaitingRoom room;
};

std::string group(int number)
{
    return "203.0.113." + std::to_string(number);
}

} // namespace

BOOST_AUTO_TEST_CASE(who_comes_first_is_first)
{
    Line line;
    BOOST_TEST(line.room.size() == 0u);
    BOOST_TEST(line.enter(7, group(1), 0, noon) == Verdict::waits);
    BOOST_TEST(line.enter(3, group(2), 0, noon + 1s) == Verdict::waits);
    BOOST_TEST(line.enter(5, group(3), 0, noon + 1s) == Verdict::waits);
    BOOST_TEST(line.ids() == (std::vector<WaitingRoom::Id>{7, 3, 5}), boost::test_tools::per_element());
    BOOST_TEST(line.first() == 7u);
    BOOST_TEST(line.ahead_of(7) == 0u);
    BOOST_TEST(line.ahead_of(5) == 2u);
    BOOST_TEST(line.leave(7));
    BOOST_TEST(!line.leave(7));
    BOOST_TEST(line.first() == 3u);
    BOOST_TEST(line.ahead_of(5) == 1u);
    BOOST_TEST(line.room.size() == 2u);
}

BOOST_AUTO_TEST_CASE(each_seat_that_a_group_has_or_waits_for_makes_it_come_later)
{
    Line line;
    line.enter(1, group(1), 2, noon);
    BOOST_TEST((line.rank(1) == noon + 20s));
    line.enter(2, group(1), 2, noon + 1s);
    BOOST_TEST((line.rank(2) == noon + 1s + 30s));
    line.enter(3, group(2), 0, noon + 15s);
    BOOST_TEST(line.first() == 3u, "another group is not late");
    line.leave(1);
    line.enter(4, group(1), 0, noon + 2s);
    BOOST_TEST((line.rank(4) == line.rank(2)), "who has left counts no more, but a group keeps its order");
    BOOST_TEST((line.rank(2) == noon + 31s), "a rank never changes");
    BOOST_TEST(line.room.size_of(group(1)) == 2u);
    BOOST_TEST(line.room.size_of(group(9)) == 0u);
}

BOOST_AUTO_TEST_CASE(a_group_is_served_in_the_order_of_arrival_although_it_has_less_by_now)
{
    Line line;
    WallTime const noon{};
    for (WaitingRoom::Id id = 1; id <= 3; ++id)
        (void)line.enter(id, "class", 10, noon); // ranks of 100 to 120 s
    line.leave(1);
    line.leave(2);
    (void)line.enter(4, "class", 0, noon + 1s); // 11 s, if it were alone
    BOOST_TEST(line.first() == 3u);
    BOOST_TEST((line.rank(4) == line.rank(3)));
    line.leave(3);
    line.leave(4);
    (void)line.enter(5, "class", 0, noon + 2s);
    BOOST_TEST((line.rank(5) == noon + 2s));
}

BOOST_AUTO_TEST_CASE(the_penalty_has_a_limit)
{
    Line line;
    for (auto const& [held, later] : {std::pair<std::size_t, Duration>(29, 290s),
                                      {30, 5min},
                                      {31, 5min},
                                      {static_cast<std::size_t>(-2), 5min}}) {
        line.enter(1, group(1), held, noon);
        BOOST_TEST((line.rank(1) == noon + later));
        line.leave(1);
    }
    WaitingRoomParams params;
    params.seat_penalty = 7s; // not a divisor
    line.room.apply(params);
    line.enter(1, group(1), 43, noon);
    BOOST_TEST((line.rank(1) == noon + 5min));
    params.seat_penalty = 0s;
    line.room.apply(params);
    line.enter(2, group(2), 43, noon);
    BOOST_TEST((line.rank(2) == noon));
    BOOST_TEST((line.rank(1) == noon + 5min));
}

BOOST_AUTO_TEST_CASE(who_belongs_to_no_group_shares_no_penalty_and_no_limit)
{
    Line line(200);
    for (WaitingRoom::Id id = 0; id < 200; ++id) {
        BOOST_TEST(line.enter(id, "", 0, noon) == Verdict::waits);
        BOOST_TEST((line.rank(id) == noon));
    }
    BOOST_TEST(line.room.size_of("") == 0u);
}

BOOST_AUTO_TEST_CASE(a_full_room_refuses)
{
    Line line(2);
    BOOST_TEST(line.enter(1, group(1), 0, noon) == Verdict::waits);
    BOOST_TEST(line.return_to(2, group(1), noon) == Verdict::waits);
    BOOST_TEST(line.room.is_full());
    BOOST_TEST(line.enter(3, group(2), 0, noon) == Verdict::full);
    BOOST_TEST(line.return_to(4, group(2), noon) == Verdict::waits, "it had a place before");
    BOOST_TEST(line.leave(4));
    BOOST_TEST(line.room.size() == 2u);
    BOOST_TEST(line.leave(1));
    BOOST_TEST(line.enter(3, group(2), 0, noon) == Verdict::waits);
    BOOST_TEST(Line(0).room.is_full());
}

BOOST_AUTO_TEST_CASE(one_group_never_fills_the_room)
{
    for (auto const& [places, most] :
         {std::pair<std::size_t, std::size_t>(1000, 250), {164, 41}, {100, 40}, {40, 40}, {12, 12}}) {
        Line line(places);
        BOOST_TEST(line.room.group_places() == most);
        for (WaitingRoom::Id id = 0; id < most; ++id)
            BOOST_TEST(line.enter(id, group(1), 0, noon) == Verdict::waits);
        auto const refused = most == places ? Verdict::full : Verdict::group_full;
        BOOST_TEST(line.enter(5000, group(1), 0, noon) == refused);
        BOOST_TEST(line.return_to(5000, group(1), noon) == Verdict::group_full);
        line.put_back(7000, group(1), noon);
        BOOST_TEST(line.leave(7000), "a turn that led nowhere costs nobody the place");
        if (most < places)
            BOOST_TEST(line.enter(5000, group(2), 0, noon) == Verdict::waits);
        line.leave(0);
        BOOST_TEST(line.enter(6000, group(1), 0, noon) == Verdict::waits);
    }
}

BOOST_AUTO_TEST_CASE(who_returns_has_the_rank_of_before)
{
    Line line;
    line.enter(1, group(1), 3, noon);
    auto const rank = line.rank(1);
    line.leave(1);
    line.enter(2, group(2), 0, noon + 31s);
    BOOST_TEST(line.return_to(3, group(1), rank) == Verdict::waits);
    BOOST_TEST((line.rank(3) == rank));
    BOOST_TEST(line.first() == 3u);
    BOOST_TEST(line.room.size_of(group(1)) == 1u, "and counts in its group");
}

BOOST_AUTO_TEST_CASE(fewer_places_send_nobody_away)
{
    Line line(3);
    for (WaitingRoom::Id id = 1; id <= 3; ++id)
        line.enter(id, group(static_cast<int>(id)), 0, noon);
    line.room.apply(Line::params_of(1));
    BOOST_TEST(line.room.size() == 3u);
    BOOST_TEST(line.room.is_full());
    line.leave(1);
    BOOST_TEST(line.enter(4, group(4), 0, noon) == Verdict::full);
}

BOOST_AUTO_TEST_CASE(ten_thousand_stand_in_the_order_of_their_ranks)
{
    constexpr WaitingRoom::Id count = 10'000;
    Line line(count);
    std::mt19937 random(1);
    std::vector<std::pair<WallTime, WaitingRoom::Id>> wanted;
    auto now = noon;
    for (WaitingRoom::Id id = 0; id < count; ++id) {
        now += std::chrono::milliseconds(random() % 200);
        auto const verdict = line.enter(id, group(static_cast<int>(random() % 100)), random() % 40, now);
        BOOST_REQUIRE(verdict == Verdict::waits);
        BOOST_REQUIRE((line.rank(id) >= now && line.rank(id) <= now + 5min));
        wanted.emplace_back(line.rank(id), id);
    }
    std::erase_if(wanted, [&](auto const& one) { return random() % 3 == 0 && line.leave(one.second); });
    std::sort(wanted.begin(), wanted.end());
    std::vector<WaitingRoom::Id> ids;
    for (auto const& [rank, id] : wanted)
        ids.push_back(id);
    BOOST_TEST(line.ids() == ids, boost::test_tools::per_element());
    BOOST_TEST(line.ahead_of(ids.at(1234)) == 1234u);
    while (line.room.size() > 0)
        line.leave(line.first());
    for (int number = 0; number < 100; ++number)
        BOOST_TEST(line.room.size_of(group(number)) == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
