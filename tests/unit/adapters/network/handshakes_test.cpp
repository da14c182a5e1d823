#include "unit_test.hpp"

#include "adapters/network/handshakes.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <algorithm>
#include <string>
#include <utility>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(handshakes)

namespace {

namespace asio = boost::asio;
using adapters::Handshakes;

asio::awaitable<void> shake(Handshakes& handshakes, std::string client, std::string& steps)
{
    co_await handshakes.turn(client);
    steps += client;
}

/// An event loop, and a client that shakes hands on fifty connections.
struct FiftyHandshakes
{
    FiftyHandshakes()
    {
        for (int connection = 0; connection < 50; ++connection)
            begin("a");
    }

    void begin(std::string client)
    {
        asio::co_spawn(context, shake(handshakes, std::move(client), steps), asio::detached);
    }

    /// Another connection, which always has something to do.
    void serve()
    {
        steps += '.';
        if (steps.size() < 200)
            asio::post(context, [this] { serve(); });
    }

    asio::io_context context{1};
    adapters::AddressSpace memory;
    Handshakes handshakes{context.get_executor(), memory};
    std::string steps;
};

} // namespace

BOOST_FIXTURE_TEST_CASE(between_two_steps_the_event_loop_serves_others, FiftyHandshakes)
{
    asio::post(context, [this] { serve(); });
    context.run();
    BOOST_TEST(std::count(steps.begin(), steps.end(), 'a') == 50);
    BOOST_TEST(steps.find("aa") == std::string::npos);
}

BOOST_FIXTURE_TEST_CASE(a_client_of_one_connection_does_not_wait_for_one_of_fifty, FiftyHandshakes)
{
    begin("b");
    context.run();
    BOOST_TEST(steps.size() == 51u);
    BOOST_TEST(steps.find('b') <= 1u);
}

BOOST_AUTO_TEST_SUITE_END()
