// What is said to a simulator before its page is connected to it, in virtual time.
#include "simulation_fixture.hpp"

#include <webots_cloud/testing/fixed_simulator_talk.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 4.1.1, `size` and `run`.
BOOST_AUTO_TEST_SUITE(early_pictures)

namespace {

using Texts = std::vector<std::string>;

constexpr auto world = "https://github.com/o/r/blob/main/worlds/a.wbt";
constexpr auto address_a = "webots:ws://host.org:2000/simulation/secreta/2001";

std::string start_with(std::string const& members)
{
    return std::string(R"({"start":{"url":")") + world + R"(","mode":"mjpeg")" + members + "}}";
}

auto const runs = start_with(R"(,"size":"1280x665","run":true)");
auto const waits = start_with(R"(,"size":"1280x665")");

struct Fixture
{
    explicit Fixture(bool gateway = true, Duration grace = {})
        : simulations(simulation_service_setup(grace), with_talk(talk), 3, ProcessLimits(), gateway)
    {}

    static SimulationServiceHooks with_talk(testing::FixedSimulatorTalk& talk)
    {
        auto hooks = simulation_service_hooks();
        hooks.simulator_talk = &talk;
        return hooks;
    }

    testing::LoopbackChannel& start(std::string const& message)
    {
        simulations.processes.expect().prints(".\n");
        return simulations.say("", message);
    }

    void stage_one()
    {
        simulations.processes.expect().prints(".\n");
        auto config = simulation_service_setup().config;
        StagedWorldConfig staged;
        staged.url = world;
        staged.count = 1;
        config.staged.push_back(staged);
        simulations.service.apply(std::move(config));
        simulations.world.settle();
    }

    testing::FixedSimulatorTalk talk;
    SimulationFixture simulations;
};

} // namespace

BOOST_AUTO_TEST_CASE(a_simulation_runs_before_its_page_hears_the_address)
{
    Fixture fixture;
    fixture.talk.answers = {"multimedia: mjpeg pause ", "stdout:hello", "real-time"};
    auto& browser = fixture.start(runs);
    BOOST_TEST_REQUIRE(fixture.talk.said.size() == 1u);
    BOOST_TEST(fixture.talk.said[0] == (Texts{"mjpeg: 1280x665", "real-time:-1"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.talk.asked[0].port == 2001);
    BOOST_TEST(browser.sent ==
                   (Texts{"shutdownTimeout: 600", "said: stdout:hello", "pictures: 1280x665", address_a}),
               boost::test_tools::per_element());
    fixture.simulations.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_page_that_does_not_run_at_once_finds_its_simulation_paused)
{
    Fixture fixture;
    fixture.talk.answers = {"paused by client"};
    auto& browser = fixture.start(waits);
    BOOST_TEST_REQUIRE(fixture.talk.said.size() == 1u);
    BOOST_TEST(fixture.talk.said[0].back() == "pause");
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "pictures: 1280x665", address_a}),
               boost::test_tools::per_element());
    fixture.simulations.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_staged_simulation_stays_paused_until_a_page_has_it)
{
    Fixture fixture;
    fixture.talk.answers = {"real-time"};
    fixture.stage_one();
    fixture.simulations.world.advance(100s);
    BOOST_TEST(fixture.talk.said.empty());
    fixture.simulations.processes.expect().prints(".\n"); // the next one that is staged
    auto& browser = fixture.simulations.say("", runs);
    BOOST_TEST_REQUIRE(fixture.talk.said.size() == 1u);
    BOOST_TEST(fixture.talk.said[0].back() == "real-time:-1");
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "pictures: 1280x665", address_a}),
               boost::test_tools::per_element());
    fixture.simulations.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_page_of_before_says_it_itself)
{
    Fixture fixture;
    auto& browser = fixture.start(start_with(""));
    BOOST_TEST(fixture.talk.said.empty());
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", address_a}), boost::test_tools::per_element());
    fixture.simulations.leave(browser);
}

BOOST_AUTO_TEST_CASE(where_the_simulator_does_not_answer_the_page_is_not_told_that_there_are_pictures)
{
    Fixture fixture;
    fixture.talk.answers = {"stdout:hello"};
    auto& browser = fixture.start(runs);
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "said: stdout:hello", address_a}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.simulations.log.contains("The simulator has not answered the server in time"));
    fixture.simulations.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_simulator_that_browsers_reach_themselves_is_theirs)
{
    Fixture fixture(false);
    auto& browser = fixture.start(runs);
    BOOST_TEST(fixture.talk.said.empty());
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "webots:ws://host.org:2001"}),
               boost::test_tools::per_element());
    fixture.simulations.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_page_that_returns_has_nothing_said_again_and_its_pictures_at_once)
{
    Fixture fixture(true, 30s);
    fixture.talk.answers = {"real-time"};
    auto& lost = fixture.start(start_with(R"(,"size":"1280x665","run":true,"reconnect":true)"));
    fixture.simulations.lose(lost);
    auto& browser = fixture.simulations.say("", R"({"reconnect":"token1"})");
    BOOST_TEST(fixture.talk.said.size() == 1u);
    BOOST_TEST(browser.sent ==
                   (Texts{"shutdownTimeout: 600", "pictures: 1280x665", address_a, "reconnectToken: token1"}),
               boost::test_tools::per_element());
    browser.browser_leaves(1000);
    fixture.simulations.world.settle();
}

BOOST_AUTO_TEST_SUITE_END()
