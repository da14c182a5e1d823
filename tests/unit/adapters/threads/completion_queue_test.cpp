#include "unit_test.hpp"

#include "adapters/threads/completion_queue.hpp"

#include <boost/asio/io_context.hpp>

#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace webots_cloud;
using adapters::CompletionQueue;
namespace asio = boost::asio;

namespace {

class Note final : public CompletionQueue::Completion
{
public:
    Note(int number, std::vector<int>& completed) : number_(number), completed_(completed) {}

    void complete() override
    {
        completed_.push_back(number_);
        if (number_ < 0)
            throw std::runtime_error("bad news");
    }

private:
    int number_;
    std::vector<int>& completed_;
};

class Counted final : public CompletionQueue::Completion
{
public:
    explicit Counted(std::shared_ptr<int> count) : count_(std::move(count)) {}
    void complete() override {}

private:
    std::shared_ptr<int> count_;
};

struct CompletionQueueFixture
{
    asio::io_context context{1};
    CompletionQueue& queue = CompletionQueue::of(context.get_executor());
    std::vector<int> completed;

    void deliver(int number) { queue.deliver(std::make_unique<Note>(number, completed)); }

    void expect(int count)
    {
        for (int i = 0; i < count; ++i)
            queue.expect();
    }
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(completion_queue, CompletionQueueFixture)

BOOST_AUTO_TEST_CASE(completions_come_in_the_order_of_their_delivery)
{
    expect(3);
    for (int const number : {1, 2, 3})
        deliver(number);
    BOOST_TEST(completed.empty()); // only the event loop completes them
    context.run();
    BOOST_TEST(completed == std::vector({1, 2, 3}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(the_event_loop_waits_for_completions_that_are_expected_and_for_no_others)
{
    context.run();
    context.restart();
    expect(1);
    std::thread thread([this] { deliver(7); });
    context.run();
    thread.join();
    BOOST_TEST(completed == std::vector({7}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(no_completion_of_many_threads_is_lost)
{
    constexpr int each = 1000;
    expect(4 * each);
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([this] {
            for (int number = 0; number < each; ++number)
                deliver(number);
        });
    context.run();
    for (auto& thread : threads)
        thread.join();
    BOOST_TEST(completed.size() == 4u * each);
}

BOOST_AUTO_TEST_CASE(one_that_throws_does_not_keep_the_others_from_completing)
{
    expect(3);
    for (int const number : {1, -2, 3})
        deliver(number);
    BOOST_CHECK_THROW(context.run(), std::runtime_error);
    context.run();
    BOOST_TEST(completed == std::vector({1, -2, 3}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(completions_that_nobody_waits_for_go_with_the_event_loop)
{
    auto const count = std::make_shared<int>();
    {
        asio::io_context other{1};
        auto& box = CompletionQueue::of(other.get_executor());
        box.expect();
        box.deliver(std::make_unique<Counted>(count));
        BOOST_TEST(count.use_count() == 2);
    }
    BOOST_TEST(count.use_count() == 1);
}

BOOST_AUTO_TEST_SUITE_END()
