#include "refusal_sentences.hpp"
#include "unit_test.hpp"

#include "core/simulation/simulator_state.hpp"

#include <ostream>
#include <string_view>
#include <vector>

using namespace webots_cloud;
using core::SimulatorState;
using namespace std::chrono_literals;

BOOST_TEST_DONT_PRINT_LOG_VALUE(SimulatorState::Due)
BOOST_TEST_DONT_PRINT_LOG_VALUE(SimulatorState::Heartbeat)
BOOST_TEST_DONT_PRINT_LOG_VALUE(SimulatorState::State)

BOOST_AUTO_TEST_SUITE(simulator_state)

using Due = SimulatorState::Due;
using Heartbeat = SimulatorState::Heartbeat;
using State = SimulatorState::State;

namespace {

constexpr auto start_timeout = 300s;
constexpr auto timeout = 600s;

TimePoint at(Duration since_start)
{
    return TimePoint() + since_start;
}

constexpr auto never = TimePoint::max();

SimulatorState started()
{
    return {at(0s), start_timeout, timeout};
}

/// What happens ten seconds after the start, one word each.
void tell(SimulatorState& simulator, std::string_view event)
{
    if (event == "heartbeat")
        (void)simulator.heartbeat(at(10s));
    else if (event == "no port")
        simulator.looked_for_port(at(10s));
    else if (event == "told")
        simulator.is_told_of_port();
    else if (event == "port")
        (void)simulator.port_opened();
    else if (event == "goes on")
        simulator.start_goes_on(at(10s));
    else if (event == "stop")
        (void)simulator.stop(Failure(errc::closed, "asked"));
    else if (event == "exit")
        simulator.exited();
    else
        BOOST_FAIL("no such event: " << event);
}

/// The state after some events, when something is due next, what that is, and what a heartbeat means.
struct Row
{
    std::vector<std::string_view> events;
    State state;
    bool was_ready;
    TimePoint deadline;
    Due due; ///< At the deadline; `nothing` where there is none.
    Heartbeat heartbeat;
};

std::ostream& operator<<(std::ostream& out, Row const& row)
{
    for (auto const event : row.events)
        out << event << ", ";
    return out;
}

SimulatorState after(std::vector<std::string_view> const& events)
{
    auto simulator = started();
    for (auto const event : events)
        tell(simulator, event);
    return simulator;
}

} // namespace

BOOST_AUTO_TEST_CASE(each_event_leads_to_one_state_and_one_deadline)
{
    using enum SimulatorState::State;
    using Pulse = Heartbeat;
    Row const timetable[] = {
        {{}, loading, false, at(300s), Due::stop_unloaded, Pulse::world_is_loaded},
        {{"goes on"}, loading, false, at(310s), Due::stop_unloaded, Pulse::world_is_loaded},
        {{"port"}, loading, false, at(300s), Due::stop_unloaded, Pulse::world_is_loaded},
        {{"heartbeat"}, opening, false, at(10s), Due::look_for_port, Pulse::ignore},
        {{"heartbeat", "heartbeat"}, opening, false, at(10s), Due::look_for_port, Pulse::ignore},
        {{"heartbeat", "no port"}, opening, false, at(10s + 1ms), Due::look_for_port, Pulse::ignore},
        {{"told", "heartbeat"}, opening, false, at(300s), Due::stop_without_port, Pulse::ignore},
        {{"told", "heartbeat", "port"}, ready, true, at(600s), Due::stop_at_time_limit, Pulse::pass_on},
        {{"told", "port"}, loading, false, at(300s), Due::stop_unloaded, Pulse::world_is_loaded},
        {{"heartbeat", "port"}, ready, true, at(600s), Due::stop_at_time_limit, Pulse::pass_on},
        {{"heartbeat", "port", "port"}, ready, true, at(600s), Due::stop_at_time_limit, Pulse::pass_on},
        {{"heartbeat", "port", "goes on"}, ready, true, at(600s), Due::stop_at_time_limit, Pulse::pass_on},
        // Nothing is due while it is being stopped, and it can't become ready any more.
        {{"stop"}, stopping, false, never, Due::nothing, Pulse::ignore},
        {{"stop", "heartbeat"}, stopping, false, never, Due::nothing, Pulse::ignore},
        {{"heartbeat", "stop", "port"}, stopping, false, never, Due::nothing, Pulse::ignore},
        {{"heartbeat", "no port", "stop"}, stopping, false, never, Due::nothing, Pulse::ignore},
        {{"heartbeat", "port", "stop"}, stopping, true, never, Due::nothing, Pulse::pass_on},
        {{"stop", "stop"}, stopping, false, never, Due::nothing, Pulse::ignore},
        {{"exit"}, ended, false, never, Due::nothing, Pulse::ignore},
        {{"exit", "stop"}, ended, false, never, Due::nothing, Pulse::ignore},
        {{"stop", "exit"}, ended, false, never, Due::nothing, Pulse::ignore},
        {{"heartbeat", "port", "exit"}, ended, true, never, Due::nothing, Pulse::pass_on},
        {{"heartbeat", "port", "stop", "exit", "stop"}, ended, true, never, Due::nothing, Pulse::pass_on},
    };
    for (auto const& row : timetable) {
        BOOST_TEST_CONTEXT(row)
        {
            auto simulator = after(row.events);
            BOOST_TEST((simulator.state() == row.state));
            BOOST_TEST(simulator.was_ready() == row.was_ready);
            BOOST_TEST(simulator.is_starting() == (row.state == loading || row.state == opening));
            BOOST_TEST((simulator.deadline() == row.deadline));
            BOOST_TEST((simulator.due(row.deadline) == row.due));
            BOOST_TEST((simulator.due(row.deadline - 1ms) == Due::nothing));
            BOOST_TEST((simulator.ends_at() == at(600s)));
            BOOST_TEST((simulator.heartbeat(at(10s)) == row.heartbeat));
        }
    }
}

// Who is looked for every 200 ms is found 100 ms too late on average: most of a start that takes 40 ms.
BOOST_AUTO_TEST_CASE(a_port_is_looked_for_so_often_that_it_is_found_an_eighth_too_late_at_most)
{
    for (auto const opens : {1ms, 7ms, 40ms, 100ms, 1000ms, 1599ms}) {
        auto simulator = started();
        (void)simulator.heartbeat(at(0ms));
        Duration found{};
        while ((found = simulator.deadline() - TimePoint()) < opens)
            simulator.looked_for_port(at(found));
        BOOST_TEST((found <= opens + std::max<Duration>(opens / 8, 1ms)), opens.count());
    }
}

BOOST_AUTO_TEST_CASE(a_port_that_stays_closed_is_looked_for_a_few_times_a_second)
{
    auto simulator = started();
    (void)simulator.heartbeat(at(0s));
    int looks = 0;
    for (TimePoint look; (look = simulator.deadline()) < at(2s); ++looks)
        simulator.looked_for_port(look);
    BOOST_TEST(looks < 60);
    auto const next = simulator.deadline();
    simulator.looked_for_port(next);
    BOOST_TEST((simulator.deadline() == next + 200ms));
}

BOOST_AUTO_TEST_CASE(the_time_limit_comes_before_all_other_reasons)
{
    SimulatorState loading(at(0s), 300s, 200s);
    BOOST_TEST((loading.deadline() == at(200s)));
    BOOST_TEST((loading.due(at(200s)) == Due::stop_at_time_limit));
    loading.start_goes_on(at(190s)); // and is not postponed by a start
    BOOST_TEST((loading.deadline() == at(200s)));
    auto const opening = after({"heartbeat"});
    BOOST_TEST((opening.due(at(600s)) == Due::stop_at_time_limit));
    BOOST_TEST((opening.due(at(300s)) == Due::stop_without_port));
}

BOOST_AUTO_TEST_CASE(each_reason_to_stop_is_a_sentence)
{
    auto const simulator = started();
    BOOST_TEST(simulator.stop_reason(Due::stop_at_time_limit).message() ==
               sentence(core::Refused::time_limit, {{"seconds", "600"}}));
    BOOST_TEST(simulator.stop_reason(Due::stop_without_port).message() ==
               sentence(core::Refused::no_port, {{"seconds", "300"}}));
    BOOST_TEST(simulator.stop_reason(Due::stop_unloaded).message() ==
               sentence(core::Refused::not_loaded, {{"seconds", "300"}}));
}

BOOST_AUTO_TEST_CASE(the_first_reason_to_stop_is_the_reason_of_the_end)
{
    auto simulator = started();
    BOOST_TEST(simulator.stop(Failure(errc::closed, "first")));
    BOOST_TEST(!simulator.stop(Failure(errc::closed, "second")));
    BOOST_TEST(simulator.end_reason("it exited with status 1", false, "words").message() == "first");
}

BOOST_AUTO_TEST_CASE(an_end_that_nobody_asked_for_has_a_reason_of_its_own)
{
    auto const starting = after({"heartbeat"});
    BOOST_TEST(starting.end_reason("it exited with status 0", true, "").message() ==
               sentence(core::Refused::ended_early, {{"how", "it exited with status 0"}}));
    BOOST_TEST(starting.end_reason("it was ended by signal 11", false, "no\aGPU").message() ==
               sentence(core::Refused::ended_early_saying,
                        {{"how", "it was ended by signal 11"}, {"words", "no\\x07GPU"}}));
    auto const ready = after({"heartbeat", "port"});
    BOOST_TEST(ready.end_reason("it exited with status 0", true, "words").message() ==
               sentence(core::Refused::quit));
    BOOST_TEST(ready.end_reason("it exited with status 1", false, "words").message() ==
               sentence(core::Refused::crashed, {{"how", "it exited with status 1"}}));
}

BOOST_AUTO_TEST_CASE(activity_is_kept_until_the_simulator_is_ready)
{
    auto simulator = started();
    BOOST_TEST(!simulator.early_activity().has_value());
    BOOST_TEST(!simulator.activity(false));
    BOOST_TEST(!simulator.activity(true));
    BOOST_TEST(simulator.early_activity().value());
    tell(simulator, "heartbeat");
    tell(simulator, "port");
    BOOST_TEST(simulator.activity(false));
    BOOST_TEST(simulator.early_activity().value());
}

BOOST_AUTO_TEST_CASE(the_controller_is_restarted_once_however_often_the_simulation_was_reset)
{
    auto simulator = started();
    BOOST_TEST(!simulator.take_restart());
    simulator.reset();
    simulator.reset();
    BOOST_TEST(simulator.take_restart());
    BOOST_TEST(!simulator.take_restart());
    simulator.reset();
    tell(simulator, "stop");
    BOOST_TEST(!simulator.take_restart());
}

BOOST_AUTO_TEST_CASE(the_time_limit_is_put_off_by_what_is_left_of_the_extension_at_most)
{
    SimulatorState simulator(at(0s), start_timeout, timeout, 100s);
    tell(simulator, "heartbeat");
    tell(simulator, "port");
    BOOST_TEST((simulator.extend(-50s) == 0s));
    BOOST_TEST((simulator.extend(60s) == 60s));
    BOOST_TEST((simulator.extendable() == 40s));
    BOOST_TEST((simulator.extend(60s) == 40s));
    BOOST_TEST((simulator.extend(60s) == 0s));
    BOOST_TEST((simulator.ends_at() == at(700s)));
    BOOST_TEST((simulator.deadline() == at(700s)));
    BOOST_TEST((simulator.due(at(699s)) == Due::nothing));
    BOOST_TEST((simulator.due(at(700s)) == Due::stop_at_time_limit));
    BOOST_TEST(simulator.stop_reason(Due::stop_at_time_limit).message() ==
               sentence(core::Refused::time_limit, {{"seconds", "700"}}));
    SimulatorState stopping(at(0s), start_timeout, timeout, 100s);
    tell(stopping, "stop");
    BOOST_TEST((stopping.extend(60s) == 0s));
    BOOST_TEST((started().extendable() == 0s));
}

BOOST_AUTO_TEST_CASE(all_times_begin_when_there_is_a_machine)
{
    auto simulator = started();
    BOOST_TEST(!simulator.begins(at(1s))); // it has not waited
    simulator.waits();
    BOOST_TEST(simulator.is_waiting());
    BOOST_TEST((simulator.deadline() == never));
    BOOST_TEST((simulator.due(at(timeout + 1s)) == Due::nothing));
    BOOST_TEST(simulator.begins(at(5000s)));
    BOOST_TEST(!simulator.is_waiting());
    BOOST_TEST((simulator.deadline() == at(5000s + start_timeout)));
    BOOST_TEST((simulator.ends_at() == at(5000s + timeout)));
    BOOST_TEST((simulator.due(at(5000s + start_timeout)) == Due::stop_unloaded));
}

BOOST_AUTO_TEST_CASE(the_life_of_one_that_nobody_has_used_begins_with_its_first_browser)
{
    auto simulator = started();
    (void)simulator.heartbeat(at(1s));
    BOOST_TEST(simulator.port_opened());
    simulator.restart_life(at(50s));
    BOOST_TEST((simulator.ends_at() == at(50s + timeout)));
    BOOST_TEST((simulator.deadline() == at(50s + timeout)));
}

BOOST_AUTO_TEST_SUITE_END()
