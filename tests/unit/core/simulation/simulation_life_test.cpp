#include "unit_test.hpp"

#include "core/simulation/simulation_life.hpp"
#include "core/text.hpp"

#include <array>
#include <ostream>
#include <string_view>
#include <vector>

using namespace webots_cloud;
using core::SimulationLife;
using namespace std::chrono_literals;

BOOST_TEST_DONT_PRINT_LOG_VALUE(SimulationLife::Action)
BOOST_TEST_DONT_PRINT_LOG_VALUE(SimulationLife::Loss)
BOOST_TEST_DONT_PRINT_LOG_VALUE(SimulationLife::Stage)
BOOST_TEST_DONT_PRINT_LOG_VALUE(SimulationLife::State)

BOOST_AUTO_TEST_SUITE(simulation_life)

using Action = SimulationLife::Action;
using Loss = SimulationLife::Loss;
using Stage = SimulationLife::Stage;
using State = SimulationLife::State;

namespace {

constexpr Duration no_grace{};

TimePoint at(Duration since_start)
{
    return TimePoint() + since_start;
}

/// What happens, in a word.
void tell_one(SimulationLife& life, std::string_view event)
{
    if (event == "fetched")
        (void)life.fetched(at(1s));
    else if (event == "launched")
        (void)life.launched(at(3s), at(100s));
    else if (event == "ready")
        (void)life.ready(at(6s));
    else if (event == "failed")
        (void)life.failed();
    else if (event == "exited")
        life.exited();
    else if (event == "left")
        life.browser_left(SimulationLife::Leaving::for_good);
    else if (event == "reloaded")
        life.browser_left(SimulationLife::Leaving::page_left);
    else if (event == "lost")
        life.browser_left(SimulationLife::Leaving::lost);
    else if (event == "taken")
        BOOST_TEST(life.take_over());
    else if (event == "refused")
        BOOST_TEST(!life.take_over());
    else if (event == "stop")
        (void)life.server_stops();
    else if (event == "ended")
        BOOST_TEST(life.operator_ends());
    else if (event == "ended_in_vain")
        BOOST_TEST(!life.operator_ends());
    else if (event == "parted")
        (void)life.connection_ended(at(10s));
    else
        BOOST_FAIL("no such event: " << event);
}

/// Any number of such words; "running" is short for all of a start.
void tell(SimulationLife& life, std::string_view events)
{
    for (auto const event : core::split(events, ' '))
        for (auto const each : core::split(event == "running" ? "fetched launched ready" : event, ' '))
            if (!each.empty())
                tell_one(life, each);
}

/// What the end of a connection leads to after some events.
struct Row
{
    Duration grace;
    std::string_view events;
    Action action;
    Loss loss;
    bool abandoned;
    bool exited;
    State state;
};

std::ostream& operator<<(std::ostream& out, Row const& row)
{
    return out << row.events << (row.grace > no_grace ? " with a grace" : " without a grace");
}

} // namespace

BOOST_AUTO_TEST_CASE(a_start_goes_through_its_stages_and_each_is_timed)
{
    SimulationLife life(no_grace, at(10s));
    BOOST_TEST((life.state() == State::fetching && life.stage() == Stage::fetching));
    BOOST_TEST((life.fetched(at(14s)) == 4s));
    BOOST_TEST((life.state() == State::launching && life.stage() == Stage::launching));
    BOOST_TEST((life.launched(at(15s), at(100s)) == 1s));
    BOOST_TEST((life.state() == State::launching && life.stage() == Stage::launching));
    BOOST_TEST((life.ready(at(22s)) == 7s));
    BOOST_TEST((life.state() == State::serving && life.stage() == Stage::idle));
    life.activity(true);
    BOOST_TEST((life.stage() == Stage::running));
    life.activity(false);
    BOOST_TEST((life.stage() == Stage::idle));
    BOOST_TEST((life.time_left(at(70s)) == 30s));
}

BOOST_AUTO_TEST_CASE(the_end_of_each_conversation_leads_to_one_thing)
{
    using enum SimulationLife::Action;
    using enum SimulationLife::Loss;
    std::vector<Row> const table{
        // Until the world is loaded, a lost browser is not waited for.
        {no_grace, "left", clean_up, none, true, false, State::ending},
        {no_grace, "lost", clean_up, not_awaited, true, false, State::ending},
        {30s, "lost", clean_up, not_ready, true, false, State::ending},
        {30s, "fetched lost", clean_up, not_ready, true, false, State::ending},
        {30s, "fetched launched lost", clean_up, not_ready, true, false, State::ending},
        {30s, "fetched launched lost stop", clean_up, none, true, false, State::ending},
        // A start that failed does not count as abandoned.
        {30s, "failed", clean_up, none, false, false, State::ending},
        {30s, "fetched failed", clean_up, none, false, false, State::ending},
        {30s, "fetched launched exited failed", clean_up, none, false, true, State::ending},
        {30s, "failed fetched launched", clean_up, none, false, false, State::ending},
        // From then on a lost browser is waited for; one that closed the connection is not.
        {no_grace, "running left", clean_up, none, false, false, State::ending},
        {no_grace, "running lost", clean_up, not_awaited, false, false, State::ending},
        {30s, "running left", clean_up, none, false, false, State::ending},
        {30s, "running lost", await_return, awaited, false, false, State::waiting},
        {30s, "running lost stop", clean_up, none, false, false, State::ending},
        {30s, "running exited", clean_up, none, false, true, State::ending},
        {30s, "running lost exited", clean_up, none, false, true, State::ending},
        // So is one whose page was left or reloaded: it may come back.
        {30s, "running reloaded", await_return, awaited, false, false, State::waiting},
        {no_grace, "running reloaded", clean_up, none, false, false, State::ending},
        {30s, "fetched reloaded", clean_up, none, true, false, State::ending},
        {30s, "running reloaded stop", clean_up, none, false, false, State::ending},
        // The wait for a browser ends as a connection does.
        {30s, "running lost parted", clean_up, not_returned, false, false, State::ending},
        {30s, "running lost parted exited", clean_up, none, false, true, State::ending},
        {30s, "running lost parted stop", clean_up, none, false, false, State::ending},
        {30s, "running lost parted taken", hand_over, none, false, false, State::serving},
        // A browser may reconnect before its old connection is found broken; one reconnects at a time.
        {30s, "running taken", hand_over, none, false, false, State::serving},
        {30s, "running taken refused lost", hand_over, none, false, false, State::serving},
        {30s, "running taken exited", clean_up, none, false, true, State::ending},
        {30s, "running lost taken parted left", clean_up, none, false, false, State::ending},
        // How the old connection ended says nothing about the new one.
        {30s, "running taken lost parted", clean_up, none, false, false, State::ending},
        {30s, "running taken parted lost", await_return, awaited, false, false, State::waiting},
    };
    for (auto const& row : table)
        BOOST_TEST_CONTEXT(row)
        {
            SimulationLife life(row.grace, at(0s));
            tell(life, row.events);
            auto const next = life.connection_ended(at(20s));
            BOOST_TEST(next.action == row.action);
            BOOST_TEST(next.loss == row.loss);
            BOOST_TEST(next.abandoned == row.abandoned);
            BOOST_TEST(next.exited == row.exited);
            BOOST_TEST(life.state() == row.state);
            if (next.action == await_return)
                BOOST_TEST((next.until == at(50s)));
        }
}

BOOST_AUTO_TEST_CASE(nobody_returns_to_what_is_not_ready_or_ends_or_waits_for_nobody)
{
    for (auto const grace : {no_grace, Duration(30s)}) {
        SimulationLife life(grace, at(0s));
        tell(life, "refused fetched launched refused ready");
        if (grace == no_grace)
            tell(life, "refused");
        BOOST_TEST(!life.is_over());
        tell(life, "exited refused parted");
        BOOST_TEST(life.is_over());
        tell(life, "refused");
        life.cleaned_up();
        BOOST_TEST((life.is_over() && life.state() == State::ended));
        tell(life, "refused");
    }
}

BOOST_AUTO_TEST_CASE(a_stop_ends_starts_and_waits_and_leaves_simulations_to_their_browsers)
{
    SimulationLife starting(30s, at(0s));
    BOOST_TEST(starting.server_stops());
    BOOST_TEST(starting.failed());
    BOOST_TEST(!starting.server_stops()); // the browser knows of its failure already
    BOOST_TEST(!starting.must_let_go());

    SimulationLife serving(30s, at(0s));
    tell(serving, "running");
    BOOST_TEST(!serving.server_stops());
    BOOST_TEST(!serving.must_let_go());

    SimulationLife waiting(30s, at(0s));
    tell(waiting, "running lost parted");
    BOOST_TEST(!waiting.must_let_go());
    BOOST_TEST(!waiting.server_stops());
    BOOST_TEST(waiting.must_let_go());

    SimulationLife late(30s, at(0s), true);
    tell(late, "running lost");
    BOOST_TEST((late.connection_ended(at(20s)).action == Action::clean_up));
}

BOOST_AUTO_TEST_CASE(the_operator_ends_a_simulation_wherever_it_is_and_nobody_returns)
{
    for (auto const* events : {"", "fetched", "fetched launched", "running", "running lost",
                               "running lost parted", "running taken parted"}) {
        SimulationLife life(30s, at(0s));
        tell(life, events);
        tell(life, "ended ended_in_vain refused");
        BOOST_TEST(life.must_let_go());
        auto const next = life.connection_ended(at(20s));
        BOOST_TEST(next.action == Action::clean_up);
        BOOST_TEST(next.loss == Loss::none);
        BOOST_TEST(life.is_over());
    }
    // The connection that takes over is the one that ends with it.
    SimulationLife taken(30s, at(0s));
    tell(taken, "running taken ended");
    BOOST_TEST((taken.connection_ended(at(20s)).action == Action::hand_over));
    BOOST_TEST(taken.must_let_go());
    BOOST_TEST((taken.connection_ended(at(20s)).action == Action::clean_up));

    SimulationLife gone(30s, at(0s));
    tell(gone, "running exited ended_in_vain parted ended_in_vain");
}

BOOST_AUTO_TEST_CASE(a_conversation_lets_go_for_the_one_that_takes_over)
{
    SimulationLife life(30s, at(0s));
    tell(life, "running");
    life.activity(true);
    tell(life, "taken");
    BOOST_TEST(life.must_let_go());
    tell(life, "parted");
    BOOST_TEST(!life.must_let_go());
    BOOST_TEST((life.state() == State::serving && life.stage() == Stage::running));
}

BOOST_AUTO_TEST_CASE(a_start_fails_once_and_the_stage_it_came_to_stays)
{
    SimulationLife life(no_grace, at(0s));
    tell(life, "fetched");
    BOOST_TEST(life.failed());
    BOOST_TEST(!life.failed());
    tell(life, "parted");
    BOOST_TEST((life.state() == State::ending && life.stage() == Stage::launching));
}

// Then its page closes its other connections, too, and hears how they end.
BOOST_AUTO_TEST_CASE(only_a_browser_that_leaves_a_running_simulation_for_good_quits)
{
    auto const quits = [](std::string_view events) {
        SimulationLife life(30s, at(0s));
        tell(life, events);
        return life.connection_ended(at(10s)).quit;
    };
    BOOST_TEST(quits("running left"));
    for (auto const* stays : {"fetched launched left", "running lost", "running exited", "running ended",
                              "running stop", "running taken", "running lost parted"})
        BOOST_TEST(!quits(stays), stays);
}

BOOST_AUTO_TEST_CASE(a_staged_simulation_waits_for_its_first_browser_and_then_is_as_others)
{
    SimulationLife life(30s, at(0s));
    life.begin_staged();
    tell(life, "fetched");
    BOOST_TEST(!life.take_staged(5s)); // it is not ready
    tell(life, "ready");
    BOOST_TEST((life.state() == State::waiting && life.stage() == Stage::idle));
    BOOST_TEST(!life.must_let_go());
    BOOST_TEST(life.take_staged(5s));
    BOOST_TEST(!life.is_staged());
    BOOST_TEST(life.must_let_go());
    BOOST_TEST(!life.take_staged(5s)); // another browser has it
    BOOST_TEST((life.connection_ended(at(10s)).action == Action::hand_over));
    BOOST_TEST((life.state() == State::serving));
    tell(life, "lost");
    auto const next = life.connection_ended(at(20s));
    BOOST_TEST((next.action == Action::await_return));
    BOOST_TEST((next.until == at(25s)));
    BOOST_TEST(!life.give_back());
}

BOOST_AUTO_TEST_CASE(a_staged_simulation_is_let_go_in_every_state_without_a_word_about_a_lost_browser)
{
    for (int const ending : {0, 1, 2})
        for (std::size_t progress = 0; progress < 3; ++progress) {
            SimulationLife life(no_grace, at(0s));
            life.begin_staged();
            for (std::size_t i = 0; i < progress; ++i)
                tell(life, std::array{"fetched", "ready"}[i]);
            BOOST_TEST(!life.must_let_go());
            if (ending == 0)
                BOOST_TEST(life.give_back());
            else if (ending == 1)
                (void)life.server_stops();
            else
                BOOST_TEST(life.operator_ends());
            BOOST_TEST(life.must_let_go());
            BOOST_TEST(!life.take_staged(5s));
            auto const next = life.connection_ended(at(10s));
            BOOST_TEST((next.action == Action::clean_up && next.loss == Loss::none));
        }
}

BOOST_AUTO_TEST_SUITE_END()
