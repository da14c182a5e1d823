#include "unit_test.hpp"

#include "core/access/client_limit.hpp"
#include "core/access/fair_queue.hpp"
#include "core/access/password_guesses.hpp"
#include "core/access/quota_levels.hpp"
#include "core/access/silent_clients.hpp"
#include "core/access/token_buckets.hpp"
#include "core/text.hpp"
#include "core/waiting/waiting_room.hpp"

#include <deque>
#include <limits>
#include <string>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;

// A home of IPv6 has 256 or 65,536 networks that each count as a client.
BOOST_AUTO_TEST_SUITE(quota_levels)

namespace {

constexpr TimePoint start{1000s};

std::string levels_of(std::string_view key)
{
    std::string text;
    for (auto const& level : core::QuotaLevels(key))
        text += core::concat(level.key, "*", std::to_string(level.factor), " ");
    return text;
}

/// The quota keys of a /48: 256 networks of each of its 256 /56.
std::string network(int of_56, int of_64)
{
    char text[64];
    std::snprintf(text, sizeof text, "2001:db8:1:%x::/64", 256 * of_56 + of_64);
    return text;
}

} // namespace

BOOST_AUTO_TEST_CASE(networks_of_ipv6_count_in_the_wider_ones_that_a_home_may_have)
{
    BOOST_TEST(levels_of("2001:db8:1:203::/64") ==
               "2001:db8:1:203::/64*1 2001:db8:1:200::/56*2 2001:db8:1::/48*4 ");
    for (auto const* const alone : {"203.0.113.7", "all", "class 123", "2001:db8::1", "fd00:1:2:3::/64",
                                    "fe80::/64", "::/64", "x/64", "/64"})
        BOOST_TEST(levels_of(alone) == core::concat(alone, "*1 "));
    BOOST_TEST(levels_of("") == "");
}

BOOST_AUTO_TEST_CASE(wider_networks_have_more_but_never_all)
{
    BOOST_TEST(core::allowance(10, 1, 100) == 10u);
    BOOST_TEST(core::allowance(10, 4, 100) == 40u);
    BOOST_TEST(core::allowance(25, 4, 100) == 75u);
    BOOST_TEST(core::allowance(90, 4, 100) == 90u);
    auto const most = std::numeric_limits<std::size_t>::max();
    BOOST_TEST(core::allowance(most, 4) == most);
    BOOST_TEST(core::allowance(most / 2, 4) == most - most / 4);
}

BOOST_AUTO_TEST_CASE(a_home_holds_no_more_than_a_few_clients)
{
    core::ClientLimit limit(10);
    std::deque<core::ClientLimit::Ticket> tickets;
    auto const admitted = [&](std::string const& key) {
        return limit.admit(key, tickets.emplace_back()) == core::ClientLimit::Verdict::admitted;
    };
    auto const count = [&](int of_56) {
        int all = 0;
        for (int i = 0; i < 256; ++i)
            all += admitted(network(of_56, i)) ? 1 : 0;
        return all;
    };
    BOOST_TEST(count(0) == 20);
    BOOST_TEST(limit.refused().key == "2001:db8:1::/56");
    BOOST_TEST(limit.refused().allowed == 20u);
    BOOST_TEST(count(1) == 20);
    BOOST_TEST(count(2) == 0);
    BOOST_TEST(limit.refused().key == "2001:db8:1::/48");
    BOOST_TEST(admitted("2001:db8:2::/64"));
    BOOST_TEST(admitted("203.0.113.7"));
    tickets.clear();
    BOOST_TEST(limit.clients() == 0u);
    BOOST_TEST(count(3) == 20);
}

BOOST_AUTO_TEST_CASE(a_home_leaves_a_quarter_of_the_simulations_to_others)
{
    core::ClientLimit limit(75, 100);
    std::deque<core::ClientLimit::Ticket> tickets;
    int admitted = 0;
    for (int i = 0; i < 300; ++i)
        admitted +=
            limit.admit(network(i % 256, i), tickets.emplace_back()) == core::ClientLimit::Verdict::admitted;
    BOOST_TEST(admitted == 75);
}

BOOST_AUTO_TEST_CASE(silent_browsers_of_a_home_make_room_for_those_of_the_same)
{
    core::SilentClients clients(256, 64);
    BOOST_TEST(!clients.enter(1, "203.0.113.7"));
    for (std::uint64_t id = 2; id < 1000; ++id)
        BOOST_TEST((clients.enter(id, network(static_cast<int>(id % 256), static_cast<int>(id % 13))) != 1u));
    BOOST_TEST(clients.size() == 1u + 192u);
    BOOST_TEST(clients.first().value() == 1u);
}

BOOST_AUTO_TEST_CASE(a_home_asks_and_guesses_as_often_as_a_few_clients)
{
    core::TokenBuckets buckets(10, 1);
    auto const taken = [&buckets](TimePoint now) {
        int count = 0;
        for (int i = 0; i < 1000; ++i)
            count +=
                buckets.take(network(i % 256, i / 256), now) == core::TokenBuckets::Verdict::taken ? 1 : 0;
        return count;
    };
    BOOST_TEST(taken(start) == 40);
    BOOST_TEST(buckets.refused_by() == "2001:db8:1::/48");
    BOOST_TEST(!buckets.has_token(network(255, 255), start));
    BOOST_TEST(buckets.has_token("2001:db8:2::/64", start));
    BOOST_TEST(taken(start + 1s) == 4);

    GuessLimit limit(core::passwords_of_client, core::passwords_of_all);
    auto const guesses = [&limit](TimePoint now) {
        int count = 0;
        for (int i = 0; i < 65'536; ++i)
            if (auto const key = network(i % 256, i / 256); limit.may_try(key, now)) {
                limit.count_wrong(key, now);
                ++count;
            }
        return count;
    };
    BOOST_TEST(guesses(start) == 40);
    BOOST_TEST(guesses(start + 10s) == 4);
    limit.count_wrong("203.0.113.7", start + 10s);
    BOOST_TEST(limit.may_try("203.0.113.7", start + 10s), "a home has not used up the guesses of all");
}

BOOST_AUTO_TEST_CASE(a_refused_network_costs_the_wider_ones_nothing)
{
    core::TokenBuckets buckets(2, 1);
    for (int i = 0; i < 10; ++i)
        (void)buckets.take(network(0, 0), start);
    BOOST_TEST(buckets.has_token(network(0, 1), start));
}

BOOST_AUTO_TEST_CASE(a_home_has_few_turns)
{
    core::FairQueue<int> queue;
    for (int i = 0; i < 200; ++i) // each for the first time
        queue.push(network(i % 256, i), i, start);
    for (int i = 0; i < 10; ++i) // a client that asks for ten things
        queue.push("203.0.113.7", 1000 + i, start);
    int before_the_last = 0;
    while (queue.pop().value() != 1009)
        ++before_the_last;
    BOOST_TEST(before_the_last < 9 + 45, before_the_last);
}

BOOST_AUTO_TEST_CASE(a_home_never_fills_the_line)
{
    struct Customer : core::WaitingRoom::Customer
    {
        using core::WaitingRoom::Customer::Customer;
    };
    core::WaitingRoom room(core::WaitingRoomParams{});
    std::deque<Customer> customers;
    auto const enter = [&](std::string const& group) {
        auto& one = customers.emplace_back(customers.size());
        one.group = group;
        one.rank = WallTime(std::chrono::hours(400'000));
        return room.enter(one, 0);
    };
    int waiting = 0;
    for (int i = 0; i < 2000; ++i)
        waiting += enter(network(i % 256, i / 256)) == core::WaitingRoom::Verdict::waits ? 1 : 0;
    BOOST_TEST(waiting == 750);
    BOOST_TEST((enter("203.0.113.7") == core::WaitingRoom::Verdict::waits));
    BOOST_TEST(room.ahead_of(customers.back()) < 45u,
               "who comes alone is before those whose home wants many");
    for (auto& one : customers)
        (void)room.leave(one);
    BOOST_TEST(room.size_of(network(0, 0)) == 0u);
    BOOST_TEST((enter(network(0, 0)) == core::WaitingRoom::Verdict::waits));
}

BOOST_AUTO_TEST_SUITE_END()
