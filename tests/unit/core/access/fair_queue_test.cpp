#include "unit_test.hpp"

#include "core/access/fair_queue.hpp"

#include <algorithm>
#include <string>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(fair_queue)

namespace {

using Queue = core::FairQueue<std::string>;

constexpr TimePoint start{1h};

/// All that wait, in their order.
std::string rest_of(Queue& queue)
{
    std::string all;
    while (auto const next = queue.pop())
        all += *next;
    return all;
}

} // namespace

BOOST_AUTO_TEST_CASE(clients_take_turns_however_much_they_ask_for)
{
    Queue queue;
    for (auto const* const thing : {"a", "b", "c"})
        queue.push("first", thing, start);
    for (auto const* const thing : {"x", "y"})
        queue.push("second", thing, start);
    queue.push("third", "1", start);
    BOOST_TEST(queue.size() == 6u);
    BOOST_TEST(rest_of(queue) == "ax1byc");
    BOOST_TEST(queue.size() == 0u);
    BOOST_TEST(!queue.pop());
}

BOOST_AUTO_TEST_CASE(who_comes_to_a_hundred_clients_that_ask_all_the_time_is_next)
{
    Queue queue;
    auto now = start;
    for (int round = 0; round < 20; ++round) { // ten times a second each; the queue is empty in between
        for (int client = 0; client < 100; ++client)
            queue.push("attacker " + std::to_string(client), "a", now);
        BOOST_TEST(rest_of(queue).size() == 100u);
        now += 100ms;
    }
    for (int client = 0; client < 100; ++client)
        queue.push("attacker " + std::to_string(client), "a", now);
    queue.push("bystander", "b", now);
    queue.push("bystander", "b", now);
    BOOST_TEST(rest_of(queue).starts_with("bba"));
}

BOOST_AUTO_TEST_CASE(who_asks_seldom_waits_for_nobody_who_asks_often)
{
    Queue queue;
    queue.push("seldom", "s", start);
    BOOST_TEST(rest_of(queue) == "s");
    auto const later = start + 250ms;
    for (int turns = 0; turns < 100; ++turns)
        queue.push("often", "o", later);
    queue.push("seldom", "s", later);
    BOOST_TEST(rest_of(queue).starts_with("oso"));
}

BOOST_AUTO_TEST_CASE(debts_end)
{
    Queue queue;
    for (int turns = 0; turns < 10'000; ++turns)
        queue.push("busy", "b", start);
    BOOST_TEST(rest_of(queue).size() == 10'000u);
    auto const later = start + 30s;
    queue.push("busy", "b", later);
    queue.push("new", "n", later);
    BOOST_TEST(rest_of(queue) == "bn");
}

BOOST_AUTO_TEST_CASE(with_more_clients_than_are_remembered_nothing_is_lost)
{
    Queue queue;
    constexpr std::size_t many = 70'000;
    for (std::size_t client = 0; client < many; ++client)
        queue.push(std::to_string(client), "c", start);
    BOOST_TEST(rest_of(queue).size() == many);
}

BOOST_AUTO_TEST_SUITE_END()
