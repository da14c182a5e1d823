#include "unit_test.hpp"

#include "forward_fixture.hpp"

#include <webots_cloud/adapters/controller_server.hpp>

#include <future>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 13.18.
BOOST_AUTO_TEST_SUITE(controller_server)

namespace {

std::string const right_key = "abcdefghijklmnopqrst";
std::string const greeting_with_key = "CTR\nRobot-Name: " + right_key + "%2Fe-puck";

/// One simulation, whose simulator is the test.
struct Door final : ControllerDoor
{
    explicit Door(std::uint16_t port) { way.upstream = Upstream("127.0.0.1", port); }

    result<ControllerWay> way_of_controller(std::uint16_t, std::string_view key,
                                            std::string_view robot) override
    {
        if (key != right_key)
            return Failure(errc::refused, "No such simulation.");
        auto found = way;
        found.asks_for = robot;
        return found;
    }

    ControllerWay way;
};

ControllerServerParams hasty()
{
    ControllerServerParams params;
    params.greeting_pause = 20ms;
    return params;
}

/// The server on a thread of its own.
class Port
{
public:
    explicit Port(ControllerServerParams params = hasty()) : door(simulator.port())
    {
        door.way.group = group;
        params.address = "127.0.0.1";
        server_ = make_controller_server(context_.get_executor(), std::move(params), door, Logger());
        BOOST_TEST_REQUIRE(server_->listen().has_value());
        auto finished = [this](std::exception_ptr failure, result<> outcome) {
            ended_.set_value(failure ? result<>(Failure(errc::unavailable)) : outcome);
        };
        boost::asio::co_spawn(context_, server_->run(),
                              boost::asio::bind_cancellation_slot(cancel_.slot(), finished));
        thread_ = std::thread([this] { context_.run(); });
    }

    ~Port()
    {
        run([this] { cancel_.emit(boost::asio::cancellation_type::terminal); });
        auto future = ended_.get_future();
        BOOST_TEST((future.wait_for(patience) == std::future_status::ready));
        context_.stop();
        thread_.join();
    }

    /// On the server's thread.
    void run(std::function<void()> const& what)
    {
        std::promise<void> done;
        boost::asio::post(context_, [&] {
            what();
            done.set_value();
        });
        done.get_future().get();
    }

    std::uint16_t port() const { return server_->port(); }

    OtherServer simulator;
    std::shared_ptr<TunnelGroup> group = std::make_shared<TunnelGroup>();
    Door door;

private:
    boost::asio::io_context context_{1};
    std::unique_ptr<ControllerServer> server_;
    boost::asio::cancellation_signal cancel_;
    std::promise<result<>> ended_;
    std::thread thread_;
};

class Controller : public BlockingConnection
{
public:
    explicit Controller(Port const& port, std::string_view greeting = {})
    {
        socket_.connect({boost::asio::ip::make_address("127.0.0.1"), port.port()});
        limit_patience();
        say(greeting);
    }
};

std::string const greeting_of_simulator = "CTR\nRobot-Name: e-puck";

/// A controller that the simulator has taken.
struct Connected
{
    explicit Connected(Port& port) : controller(port, greeting_with_key), simulator(port.simulator.acceptor)
    {
        BOOST_TEST_REQUIRE(simulator.read(greeting_of_simulator.size()) == greeting_of_simulator);
        simulator.say("CONNECTED");
        BOOST_TEST_REQUIRE(controller.read(9) == "CONNECTED");
    }

    Controller controller;
    UpstreamPeer simulator;
};

} // namespace

BOOST_AUTO_TEST_CASE(what_follows_the_greetings_is_relayed_as_it_is)
{
    Port port;
    Connected both(port);
    std::string const request("\x0a\0\0\0\x20\0\0\0\n\xff\r\n\r\n", 14);
    both.controller.say(request);
    BOOST_TEST(both.simulator.read(request.size()) == request);
    auto const image = much(3'000'000);
    auto sent = std::async(std::launch::async, [&] { both.simulator.say(image); });
    BOOST_TEST((both.controller.read(image.size()) == image));
    sent.get();
    BOOST_TEST(eventually([&] { // they are counted as the simulation's
        std::uint64_t count = 0;
        port.run([&] { count = port.group->sent(); });
        return count >= image.size();
    }));
    both.controller.shut_down();
    BOOST_TEST(both.simulator.read_all() == "");
}

BOOST_AUTO_TEST_CASE(a_greeting_may_come_in_pieces)
{
    ControllerServerParams params;
    params.greeting_pause = 500ms;
    Port port(params);
    Controller controller(port);
    for (char const byte : greeting_with_key)
        controller.say(std::string(1, byte));
    UpstreamPeer simulator(port.simulator.acceptor);
    BOOST_TEST(simulator.read(greeting_of_simulator.size()) == greeting_of_simulator);
    simulator.say("CON");
    simulator.say("NECTED");
    BOOST_TEST(controller.read(9) == "CONNECTED");
}

BOOST_AUTO_TEST_CASE(what_the_simulator_answers_with_the_first_bytes_is_passed_on)
{
    Port port;
    Controller controller(port, greeting_with_key);
    UpstreamPeer simulator(port.simulator.acceptor);
    simulator.say("CONNECTED and more");
    BOOST_TEST(controller.read(18) == "CONNECTED and more");
}

// libController closes no connection on which it was refused, and tries again every second.
BOOST_AUTO_TEST_CASE(a_connection_that_the_simulator_refuses_ends)
{
    Port port;
    for (std::string const answer : {"FAILED", "PROCESSING", "FORBIDDEN"}) {
        Controller controller(port, greeting_with_key);
        UpstreamPeer simulator(port.simulator.acceptor);
        simulator.read(greeting_of_simulator.size());
        simulator.say(answer);
        BOOST_TEST(controller.read_all() == answer);
        BOOST_TEST(simulator.read_all() == "");
    }
}

BOOST_AUTO_TEST_CASE(who_is_refused_is_told_so_in_webots_words_and_with_a_reason)
{
    Port port;
    auto const answer = [&](std::string const& bytes) { return Controller(port, bytes).read_all(); };
    BOOST_TEST(answer("CTR\nRobot-Name: bbcdefghijklmnopqrst%2Fe-puck") ==
               "FORBIDDEN: No such simulation.\n");
    BOOST_TEST(answer("CTR").starts_with("FORBIDDEN: WEBOTS_CONTROLLER_URL has no key"));
    BOOST_TEST(answer("CTR\nRobot-Name: e-puck").starts_with("FORBIDDEN: The path of WEBOTS_CONTROLLER_URL"));
    BOOST_TEST(answer("GET / HTTP/1.1\r\nHost: x\r\n\r\n").starts_with("FORBIDDEN: Only controllers"));
    BOOST_TEST(answer(greeting_with_key + std::string("\0x", 2)).starts_with("FORBIDDEN: "));
    BOOST_TEST(answer("CTR\nRobot-Name: " + right_key + std::string(1100, 'x')).starts_with("FORBIDDEN: "));
}

BOOST_AUTO_TEST_CASE(where_the_simulator_is_not_reached_the_library_is_to_try_again)
{
    Port port;
    port.simulator.close();
    BOOST_TEST(Controller(port, greeting_with_key).read_all() ==
               "FAILED: The simulator does not answer: try again in a moment.\n");
}

BOOST_AUTO_TEST_CASE(a_simulator_that_does_not_answer_is_not_waited_for_for_ever)
{
    auto params = hasty();
    params.answer_timeout = 50ms;
    Port port(params);
    Controller controller(port, greeting_with_key);
    UpstreamPeer simulator(port.simulator.acceptor);
    BOOST_TEST(controller.read_all().starts_with("FAILED: The simulator does not answer"));
}

BOOST_AUTO_TEST_CASE(who_says_nothing_is_not_waited_for_for_ever)
{
    auto params = hasty();
    params.greeting_timeout = 50ms;
    Port port(params);
    BOOST_TEST(Controller(port).read_all() == "");
    BOOST_TEST(Controller(port, "CT").read_all().starts_with("FORBIDDEN: Only controllers"));
}

BOOST_AUTO_TEST_CASE(who_says_nothing_makes_room_for_others)
{
    auto params = hasty();
    params.max_greeting = params.greeting_per_address = 2;
    Port port(params);
    Controller first(port);
    Controller second(port);
    Controller third(port);
    BOOST_TEST(first.read_all() == "");
    third.say(greeting_with_key);
    UpstreamPeer simulator(port.simulator.acceptor);
    BOOST_TEST(simulator.read(greeting_of_simulator.size()) == greeting_of_simulator);
}

BOOST_AUTO_TEST_CASE(a_simulation_has_so_many_controllers_and_a_new_one_when_another_has_left)
{
    auto params = hasty();
    params.per_simulation = 1;
    Port port(params);
    {
        Connected one(port);
        BOOST_TEST(Controller(port, greeting_with_key)
                       .read_all()
                       .starts_with("FORBIDDEN: This simulation has 1 controllers, as many as it may have"));
    }
    BOOST_TEST(eventually([&] {
        std::size_t open = 1;
        port.run([&] { open = port.group->open(); });
        return open == 0;
    }));
    Connected next(port);
}

BOOST_AUTO_TEST_CASE(the_port_has_so_many_connections)
{
    auto params = hasty();
    params.max_connections = 1;
    Port port(params);
    Connected one(port);
    BOOST_TEST(Controller(port, greeting_with_key).read_all() == "");
}

BOOST_AUTO_TEST_CASE(connections_end_with_their_simulation)
{
    Port port;
    Connected one(port);
    Controller greeting(port, greeting_with_key);
    UpstreamPeer asked(port.simulator.acceptor);
    BOOST_TEST(asked.read(greeting_of_simulator.size()) == greeting_of_simulator);
    port.run([&] { port.group->close(); });
    BOOST_TEST(one.controller.read_all() == "");
    BOOST_TEST(one.simulator.read_all() == "");
    BOOST_TEST(greeting.read_all() == "");
    BOOST_TEST(asked.read_all() == "");
    BOOST_TEST(Controller(port, greeting_with_key).read_all() ==
               "FORBIDDEN: This simulation has just ended.\n");
}

BOOST_AUTO_TEST_CASE(a_server_that_stops_ends_all_connections)
{
    std::optional<Port> port(std::in_place);
    Connected one(*port);
    Controller silent(*port);
    port.reset();
    BOOST_TEST(one.controller.read_all() == "");
    BOOST_TEST(silent.read_all() == "");
}

BOOST_AUTO_TEST_SUITE_END()
