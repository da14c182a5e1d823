// Each row of `situations` is one of the table "What a site is" in docs/visitors.md:
// tests/hygiene/site_states.py compares them.
#include "unit_test.hpp"

#include "core/site_state.hpp"

#include <set>
#include <string>
#include <utility>
#include <vector>

using namespace webots_cloud;
using core::SiteState;

BOOST_AUTO_TEST_SUITE(site_state)

namespace {

struct Situation
{
    std::string_view what;
    std::vector<std::pair<Refusal, std::size_t>> machines;
    bool is_available; // as the scheduler says
    std::size_t waiting;
    SiteState state;
};

// clang-format off
std::vector<Situation> const situations{
    {"a machine has room, and nobody waits", {{Refusal::none, 1}, {Refusal::full, 3}}, true, 0, SiteState::free},
    {"a machine has room, but not for the worlds of those who wait", {{Refusal::none, 2}}, true, 3, SiteState::busy},
    {"seats are free, but processors or memory are used up", {{Refusal::load, 1}, {Refusal::full, 1}}, false, 3, SiteState::busy},
    {"every seat is taken", {{Refusal::full, 4}, {Refusal::lost, 1}}, false, 3, SiteState::full},
    {"every seat is given away, though not everybody is there yet", {{Refusal::full, 1}}, true, 0, SiteState::full},
    {"what is free is reserved for classes", {{Refusal::none, 1}}, false, 0, SiteState::full},
    {"every machine that answers is drained", {{Refusal::draining, 2}, {Refusal::lost, 1}}, false, 0, SiteState::draining},
    {"no machine answers", {{Refusal::lost, 2}, {Refusal::stale, 1}, {Refusal::unknown, 1}}, false, 2, SiteState::down},
    {"there is no machine", {}, false, 0, SiteState::down},
};
// clang-format on

core::SiteFacts facts_of(Situation const& situation)
{
    core::SiteFacts facts;
    for (auto const& [refusal, count] : situation.machines)
        facts.machines[static_cast<std::size_t>(refusal)] = count;
    facts.is_available = situation.is_available;
    facts.can_wait = true;
    facts.waiting = situation.waiting;
    return facts;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_site_is_what_somebody_meets_who_comes_now)
{
    for (auto const& situation : situations)
        BOOST_TEST((core::site_state(facts_of(situation)) == situation.state), situation.what);
}

BOOST_AUTO_TEST_CASE(until_every_machine_was_asked_nobody_knows)
{
    core::SiteFacts facts;
    facts.is_awaited = true;
    facts.machines[static_cast<std::size_t>(Refusal::unknown)] = 1;
    BOOST_TEST((core::site_state(facts) == SiteState::unknown));
    facts.machines[static_cast<std::size_t>(Refusal::full)] = 1;
    BOOST_TEST((core::site_state(facts) == SiteState::full), "that is known already");
}

BOOST_AUTO_TEST_CASE(where_nobody_waits_the_machine_itself_says_that_it_is_full)
{
    auto facts = facts_of(situations[4]);
    facts.can_wait = false;
    BOOST_TEST((core::site_state(facts) == SiteState::free));
}

BOOST_AUTO_TEST_CASE(a_machine_is_said_to_be_in_the_same_words)
{
    BOOST_TEST((core::machine_state(Refusal::none, false) == SiteState::free));
    BOOST_TEST((core::machine_state(Refusal::full, false) == SiteState::full));
    BOOST_TEST((core::machine_state(Refusal::load, false) == SiteState::busy));
    BOOST_TEST((core::machine_state(Refusal::memory, false) == SiteState::busy));
    BOOST_TEST((core::machine_state(Refusal::draining, false) == SiteState::draining));
    BOOST_TEST((core::machine_state(Refusal::lost, false) == SiteState::down));
    BOOST_TEST((core::machine_state(Refusal::unknown, true) == SiteState::unknown));
    BOOST_TEST((core::machine_state(Refusal::unknown, false) == SiteState::down));
}

BOOST_AUTO_TEST_CASE(every_state_has_a_word_and_a_sentence_of_its_own)
{
    std::set<std::string_view> words;
    std::set<std::string_view> sentences;
    for (auto const state : core::all_site_states) {
        words.insert(core::word_of(state));
        sentences.insert(core::sentence_of(state));
    }
    BOOST_TEST(words.size() == core::all_site_states.size());
    BOOST_TEST(sentences.size() == core::all_site_states.size());
    BOOST_TEST(!words.contains(""));
}

BOOST_AUTO_TEST_SUITE_END()
