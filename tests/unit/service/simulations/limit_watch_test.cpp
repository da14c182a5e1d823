#include "gate.hpp"
#include "refusal_sentences.hpp"
#include "simulation_fixture.hpp"

#include <webots_cloud/testing/fixed_folder_meter.hpp>

#include <csignal>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(limit_watch)

namespace {

constexpr std::uint64_t megabyte = std::uint64_t{1} << 20;
constexpr auto start_message =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg"}})";

ProcessLimits limits()
{
    ProcessLimits limits;
    limits.memory = 200 * megabyte;
    limits.processes = 50;
    limits.files = 100;
    limits.disk = 10 * megabyte;
    return limits;
}

SimulationServiceHooks hooks_with(FolderMeter& meter)
{
    auto hooks = simulation_service_hooks();
    hooks.folder_meter = &meter;
    return hooks;
}

/// Says what a folder holds when its gate, if it has one, is open.
class GatedMeter final : public FolderMeter
{
public:
    boost::asio::awaitable<FolderUse> measure(std::filesystem::path, std::uint64_t) override
    {
        if (gate)
            co_await gate->pass();
        co_return FolderUse();
    }

    Gate* gate = nullptr;
};

/// As Meter.
struct SlowMeter
{
    GatedMeter meter;
};

/// Before the fixture, whose service uses it.
struct Meter
{
    testing::FixedFolderMeter meter;
};

struct Fixture : Meter, SimulationFixture
{
    Fixture() : SimulationFixture(simulation_service_setup(), hooks_with(meter), 2, limits())
    {
        meter.use.free_bytes = 1000 * megabyte;
    }

    testing::LoopbackChannel& start() { return say("", start_message); }
};

bool ends_with(std::string const& text, std::string_view end)
{
    return text.ends_with(end);
}

} // namespace

BOOST_AUTO_TEST_CASE(simulations_are_started_with_their_limits)
{
    Fixture fixture;
    fixture.processes.expect();
    auto& browser = fixture.start();
    BOOST_TEST((fixture.processes.started().front().limits == limits()));
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(who_has_too_much_memory_is_ended_and_told_while_the_neighbour_goes_on)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").consumes(10, 200 * megabyte);
    fixture.processes.expect().prints(".\n").consumes(10, 201 * megabyte);
    auto& neighbour = fixture.start();
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() == error_line(core::Refused::memory_overrun, {{"max", "200"}}));
    BOOST_TEST(browser.close_code.has_value());
    BOOST_TEST(!neighbour.close_code.has_value());
    BOOST_TEST(fixture.service.sessions() == 1U);
    BOOST_TEST(fixture.get("/metrics").body.find("simulations_over_limit_total{limit=\"memory\"} 1\n") !=
               std::string::npos);
    fixture.leave(neighbour);
}

BOOST_AUTO_TEST_CASE(who_has_too_many_processes_is_ended)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").starts(51);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(ends_with(browser.sent.back(), "can raise \"simulationProcesses\"."), browser.sent.back());
}

BOOST_AUTO_TEST_CASE(a_process_that_the_kernel_killed_for_memory_ends_the_simulation)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").loses_a_process_for_memory();
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(ends_with(browser.sent.back(), "can raise \"simulationMemory\"."), browser.sent.back());
}

BOOST_AUTO_TEST_CASE(a_simulator_that_was_itself_killed_for_memory_says_so)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").loses_a_process_for_memory().after(100ms).crashes(SIGKILL);
    auto& browser = fixture.start();
    fixture.world.advance(200ms);
    BOOST_TEST(ends_with(browser.sent.back(), "can raise \"simulationMemory\"."), browser.sent.back());
    BOOST_TEST(fixture.get("/metrics").body.find("simulations_over_limit_total{limit=\"memory\"} 1\n") !=
               std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_simulator_that_wrote_too_large_a_file_says_so)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(100ms).crashes(SIGXFSZ);
    auto& browser = fixture.start();
    fixture.world.advance(200ms);
    BOOST_TEST(ends_with(browser.sent.back(), "can raise \"simulationDisk\"."), browser.sent.back());
}

BOOST_AUTO_TEST_CASE(who_fills_its_folder_is_ended)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST_REQUIRE(fixture.meter.measured.size() == 1U);
    BOOST_TEST(fixture.meter.measured.front() == "/instances/1");
    BOOST_TEST(!browser.close_code.has_value());
    fixture.meter.use.bytes = 10 * megabyte + 1;
    fixture.world.advance(1s);
    BOOST_TEST(ends_with(browser.sent.back(), "can raise \"simulationDisk\"."), browser.sent.back());
    BOOST_TEST(fixture.service.sessions() == 0U);
}

BOOST_AUTO_TEST_CASE(a_start_that_overruns_a_limit_has_failed)
{
    Fixture fixture;
    fixture.processes.expect().prints("loading\n").consumes(10, 201 * megabyte);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(ends_with(browser.sent.back(), "can raise \"simulationMemory\"."), browser.sent.back());
    BOOST_TEST(
        fixture.get("/metrics").body.find("starts_total{result=\"failed\",reason=\"start_failed\"} 1\n") !=
        std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_server_that_is_stopped_while_it_measures_a_folder_ends_when_that_is_done)
{
    struct GatedFixture : SlowMeter, SimulationFixture
    {
        GatedFixture() : SimulationFixture(simulation_service_setup(), hooks_with(meter), 2, limits()) {}

        Gate gate{world.executor()};
    } fixture;
    fixture.meter.gate = &fixture.gate;
    fixture.gate.close();
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.say("", start_message);
    fixture.world.advance(1s);
    BOOST_TEST_REQUIRE(fixture.gate.is_awaited());
    fixture.tasks.cancel_all();
    fixture.world.settle();
    BOOST_TEST(fixture.tasks.size() == 1U);
    fixture.gate.open();
    fixture.world.settle();
    BOOST_TEST(fixture.tasks.size() == 0U);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(metrics_sum_up_what_simulations_use)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").consumes(50, 1'000'000).starts(2);
    fixture.processes.expect().prints(".\n").consumes(100, 2'000'000).starts(3);
    auto& first = fixture.start();
    auto& second = fixture.start();
    fixture.world.advance(1s);
    auto const text = fixture.get("/metrics").body;
    for (auto const* line :
         {"simulations_memory_bytes 3000000\n", "simulations_processes 5\n", "simulations_processors 1.5\n",
          "simulations_over_limit_total{limit=\"disk\"} 0\n"})
        BOOST_TEST(text.find(line) != std::string::npos, line << " is not in " << text);
    fixture.leave(first);
    fixture.leave(second);
}

BOOST_AUTO_TEST_SUITE_END()
