#include "unit_test.hpp"

#include "core/relay/machine_questions.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(machine_questions)

using Askers = std::vector<MachineQuestions::Asker>;

namespace {

TimePoint const now = TimePoint(1h);

bool is(MachineQuestions::Verdict one, MachineQuestions::Verdict other)
{
    return one == other;
}

} // namespace

BOOST_AUTO_TEST_CASE(however_many_wait_for_its_answer_a_machine_is_asked_once)
{
    using enum MachineQuestions::Verdict;
    MachineQuestions questions;
    BOOST_TEST(is(questions.ask("a", 1, now), ask));
    BOOST_TEST(is(questions.ask("a", 2, now), wait));
    BOOST_TEST(is(questions.ask("b", 2, now), ask));
    BOOST_TEST(questions.is_open("a"));
    BOOST_TEST(questions.answered("a") == (Askers{1, 2}), boost::test_tools::per_element());
    BOOST_TEST(!questions.is_open("a"));
    BOOST_TEST(questions.is_open("b"));
    BOOST_TEST(questions.answered("a").empty());
    BOOST_TEST(is(questions.ask("a", 3, now), ask));
}

BOOST_AUTO_TEST_CASE(a_machine_that_does_not_answer_in_time_rests)
{
    using enum MachineQuestions::Verdict;
    MachineQuestions questions;
    auto const late = now + MachineQuestions::patience;
    (void)questions.ask("a", 1, now);
    (void)questions.ask("a", 2, now + 100ms);
    questions.give_up("a", late);
    BOOST_TEST(!questions.is_open("a"));
    BOOST_TEST(is(questions.ask("a", 3, late + MachineQuestions::pause - 1ms), pass));
    BOOST_TEST(questions.answered("a") == (Askers{1, 2}), boost::test_tools::per_element());
    BOOST_TEST(is(questions.ask("a", 3, late + MachineQuestions::pause), ask));
}

BOOST_AUTO_TEST_CASE(who_had_no_time_left_when_it_was_asked_says_nothing_about_a_machine)
{
    using enum MachineQuestions::Verdict;
    MachineQuestions questions;
    (void)questions.ask("a", 1, now);
    questions.give_up("a", now + MachineQuestions::patience - 1ms);
    BOOST_TEST(questions.is_open("a"));
    BOOST_TEST(is(questions.ask("a", 2, now + MachineQuestions::patience - 1ms), wait));
}

BOOST_AUTO_TEST_CASE(who_gives_up_after_the_answer_changes_nothing)
{
    using enum MachineQuestions::Verdict;
    MachineQuestions questions;
    (void)questions.ask("a", 1, now);
    (void)questions.answered("a");
    questions.give_up("a", now + MachineQuestions::patience);
    questions.give_up("unheard of", now);
    BOOST_TEST(is(questions.ask("a", 1, now), ask));
}

BOOST_AUTO_TEST_CASE(of_machines_that_have_left_the_list_nobody_waits_for_an_answer)
{
    MachineQuestions questions;
    (void)questions.ask("a", 1, now);
    (void)questions.ask("b", 1, now);
    questions.forget("a");
    questions.forget("c");
    BOOST_TEST(!questions.is_open("a"));
    BOOST_TEST(questions.is_open("b"));
}

BOOST_AUTO_TEST_SUITE_END()
