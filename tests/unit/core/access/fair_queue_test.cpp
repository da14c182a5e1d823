#include "unit_test.hpp"

#include "core/access/fair_queue.hpp"

#include <algorithm>
#include <string>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(fair_queue)

namespace {

using Queue = core::FairQueue<std::string>;

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
        queue.push("first", thing);
    for (auto const* const thing : {"x", "y"})
        queue.push("second", thing);
    queue.push("third", "1");
    BOOST_TEST(queue.size() == 6u);
    BOOST_TEST(rest_of(queue) == "ax1byc");
    BOOST_TEST(queue.size() == 0u);
    BOOST_TEST(!queue.pop());
}

BOOST_AUTO_TEST_CASE(who_comes_to_a_hundred_clients_that_always_wait_is_next)
{
    Queue queue;
    for (int round = 0; round < 20; ++round)
        for (int client = 0; client < 100; ++client)
            queue.push("attacker " + std::to_string(client), "a");
    for (int turns = 0; turns < 1'000; ++turns)
        BOOST_TEST(*queue.pop() == "a");
    queue.push("bystander", "b");
    queue.push("bystander", "b");
    BOOST_TEST(*queue.pop() == "b");
    BOOST_TEST(*queue.pop() == "b");
    BOOST_TEST(*queue.pop() == "a");
}

BOOST_AUTO_TEST_CASE(nobody_collects_turns_by_being_silent)
{
    Queue queue;
    for (int turns = 0; turns < 1'000; ++turns)
        queue.push("busy", "b");
    for (int turns = 0; turns < 500; ++turns)
        (void)queue.pop();
    for (int turns = 0; turns < 500; ++turns)
        queue.push("silent", "s");
    auto const order = rest_of(queue);
    auto const head = order.substr(0, 100);
    auto const of_the_silent = std::count(head.begin(), head.end(), 's');
    BOOST_TEST(of_the_silent >= 50);
    BOOST_TEST(of_the_silent < 60); // half, and the few of the credit
    BOOST_TEST(order.size() == 1'000u);
}

BOOST_AUTO_TEST_CASE(with_more_clients_than_are_remembered_nothing_is_lost)
{
    Queue queue;
    constexpr std::size_t many = 70'000;
    for (std::size_t client = 0; client < many; ++client)
        queue.push(std::to_string(client), "c");
    BOOST_TEST(rest_of(queue).size() == many);
}

BOOST_AUTO_TEST_SUITE_END()
