#include "unit_test.hpp"

#include <webots_cloud/testing/scripted_websockets.hpp>
#include <webots_cloud/testing/world.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(scripted_websockets)

namespace {

using Connected = result<std::unique_ptr<Channel>>;

boost::asio::awaitable<void> receive_to_end(Channel& channel, std::vector<std::string>& texts,
                                            Failure& failure)
{
    for (;;) {
        auto text = co_await channel.receive();
        if (!text) {
            failure = text.error();
            co_return;
        }
        texts.push_back(std::move(*text));
    }
}

struct Fixture
{
    Connected connect(WebSocketRequest request) { return world.run(sockets.connect(std::move(request))); }
    Connected connect(std::string url) { return connect(WebSocketRequest(std::move(url))); }

    testing::World world;
    testing::ScriptedWebSockets sockets{world.clock};
};

} // namespace

BOOST_AUTO_TEST_CASE(both_sides_of_a_channel_talk)
{
    std::vector<std::string> texts;
    Failure failure;
    Fixture fixture;
    fixture.sockets.expect("ws://a/client");
    WebSocketRequest request("ws://a/client");
    request.headers.emplace_back("X-Forwarded-For", "10.0.0.1");
    auto channel = fixture.connect(request);
    BOOST_TEST_REQUIRE(channel.has_value());
    auto& peer = fixture.sockets.peer("ws://a/client");
    BOOST_TEST(peer.request().headers.front().second == "10.0.0.1");

    fixture.world.spawn(receive_to_end(**channel, texts, failure));
    peer.says("one");
    peer.says("two");
    fixture.world.settle();
    BOOST_TEST(texts == (std::vector<std::string>{"one", "two"}), boost::test_tools::per_element());
    BOOST_TEST((*channel)->send("three").has_value());
    BOOST_TEST(peer.was_told("thr"));

    peer.closes(4000);
    fixture.world.settle();
    BOOST_TEST((failure == errc::closed));
    BOOST_TEST((*channel)->farewell() == 4000);
    BOOST_TEST(((*channel)->send("four").error() == errc::closed));
    BOOST_TEST(!peer.dropped_at().has_value());
    channel->reset();
    BOOST_TEST((peer.dropped_at() == fixture.world.clock.now()));
}

BOOST_AUTO_TEST_CASE(a_connection_is_lost)
{
    std::vector<std::string> texts;
    Failure failure;
    Fixture fixture;
    fixture.sockets.expect("ws://a/client");
    auto channel = fixture.connect("ws://a/client");
    BOOST_TEST_REQUIRE(channel.has_value());
    fixture.world.spawn(receive_to_end(**channel, texts, failure));
    fixture.sockets.peer(0).is_lost();
    fixture.world.settle();
    BOOST_TEST((failure == errc::unreachable));
    BOOST_TEST((*channel)->farewell() == 0);
}

BOOST_AUTO_TEST_CASE(limits_are_those_of_the_request)
{
    Fixture fixture;
    fixture.sockets.expect("ws://a/client").always();
    WebSocketRequest request("ws://a/client");
    request.max_message = 4;
    request.max_queued = 10;
    auto talkative = fixture.connect(request);
    BOOST_TEST_REQUIRE(talkative.has_value());
    fixture.sockets.peer(0).says("12345");
    BOOST_TEST((fixture.sockets.peer(0).close_code() == 1009));

    auto deaf = fixture.connect(request);
    BOOST_TEST_REQUIRE(deaf.has_value());
    fixture.sockets.peer(1).stops_reading();
    BOOST_TEST((*deaf)->send("1234567890").has_value());
    BOOST_TEST((*deaf)->queued() == 10);
    BOOST_TEST(((*deaf)->send("1").error() == errc::too_large));
    BOOST_TEST(((*deaf)->send("1").error() == errc::closed));
}

BOOST_AUTO_TEST_CASE(requests_that_fail)
{
    Fixture fixture;
    fixture.sockets.expect("ws://a/client").fail(Failure(errc::unreachable, "no"));
    fixture.sockets.expect("ws://a/client").after(2s);
    fixture.sockets.expect("ws://a/client").hang();
    BOOST_TEST((fixture.connect("ws://a/client").error() == errc::unreachable));
    auto const start = fixture.world.clock.now();
    BOOST_TEST(fixture.connect("ws://a/client").has_value());
    BOOST_TEST((fixture.world.clock.now() - start == 2s));
    BOOST_TEST(fixture.sockets.unused() == "ws://a/client\n");
    BOOST_TEST((fixture.connect("ws://a/client").error() == errc::timed_out));
    BOOST_TEST((fixture.world.clock.now() - start == 7s));
    BOOST_TEST(fixture.connect("ws://a/client").error().detail().starts_with("not in the script"));
    BOOST_TEST(fixture.sockets.requests().size() == 4U);
    BOOST_TEST(fixture.sockets.accepted() == 1U);
    BOOST_TEST(fixture.sockets.unused().empty());
}

BOOST_AUTO_TEST_SUITE_END()
