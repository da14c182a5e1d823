#include "unit_test.hpp"

#include "core/waiting/waiting_messages.hpp"

#include <array>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::SiteState;
using core::WaitRange;
using core::WaitReason;

BOOST_AUTO_TEST_SUITE(waiting_messages)

namespace {

std::string sentence(Duration least, Duration most)
{
    auto const text = core::waiting_sentence({0, WaitRange{least, most}});
    constexpr std::string_view before = "loading: You are next; the wait ";
    BOOST_TEST(text.starts_with(before));
    return text.substr(before.size());
}

} // namespace

BOOST_AUTO_TEST_CASE(every_browser_hears_how_many_are_ahead)
{
    BOOST_TEST(core::queue_message(0) == "queue:0");
    BOOST_TEST(core::queue_message(12) == "queue:12");
}

BOOST_AUTO_TEST_CASE(the_sentence_says_place_and_wait)
{
    BOOST_TEST(core::waiting_sentence({3, WaitRange{1min, 4min}}) ==
               "loading: 3 are ahead of you; the wait is about 1 to 4 minutes.");
    BOOST_TEST(core::waiting_sentence({1, WaitRange{5s, 20s}}) ==
               "loading: 1 is ahead of you; the wait is about 5 to 20 seconds.");
    BOOST_TEST(core::waiting_sentence({0, WaitRange{30s, 2min}}) ==
               "loading: You are next; the wait is about 30 seconds to 2 minutes.");
    BOOST_TEST(core::waiting_sentence({0, std::nullopt}) ==
               "loading: You are next; there is no estimate of the wait yet.");
    BOOST_TEST(core::waiting_sentence({2, std::nullopt}) ==
               "loading: 2 are ahead of you; there is no estimate of the wait yet.");
    BOOST_TEST(core::waiting_sentence({0, WaitRange{0s, 81s}, WaitReason::room}) ==
               "loading: You are next, and no free machine has enough power left for this world; "
               "the wait is less than 1.5 minutes.");
    BOOST_TEST(core::waiting_sentence({0, std::nullopt, WaitReason::down}) ==
               "loading: You are next, but no machine is running; there is no estimate of the wait yet.");
}

BOOST_AUTO_TEST_CASE(waits_are_said_as_people_say_them)
{
    BOOST_TEST(sentence(0s, 9s) == "is less than 10 seconds.");
    BOOST_TEST(sentence(1s, 56s) == "is less than 1 minute.");
    BOOST_TEST(sentence(91s, 269s) == "is about 1.5 to 4.5 minutes.");
    BOOST_TEST(sentence(6min, 6min) == "is about 6 minutes.");
    BOOST_TEST(sentence(1min, 1min) == "is about 1 minute.");
    BOOST_TEST(sentence(51s, 1min) == "is about 50 seconds to 1 minute.");
    BOOST_TEST(sentence(8min + 29s, 33min) == "is about 8 to 35 minutes.");
    BOOST_TEST(sentence(40min, 59min) == "is about 40 minutes to an hour.");
    BOOST_TEST(sentence(1s, 1h) == "is less than an hour.");
}

BOOST_AUTO_TEST_CASE(beyond_an_hour_nobody_counts_minutes)
{
    BOOST_TEST(sentence(20min, 2h) == "is at least 20 minutes, and may be more than an hour.");
    BOOST_TEST(sentence(30s, 2h) == "is at least 30 seconds, and may be more than an hour.");
    BOOST_TEST(sentence(0s, 2h) == "may be more than an hour.");
    BOOST_TEST(sentence(1h, 2h) == "is more than an hour.");
    BOOST_TEST(sentence(30h, 40h) == "is more than an hour.");
}

BOOST_AUTO_TEST_CASE(who_can_say_it_gets_numbers)
{
    BOOST_TEST(core::waiting_message({3, WaitRange{62s, 236s}}) == "waiting: 3 60 240");
    BOOST_TEST(core::waiting_message({0, WaitRange{1s, 7200s}}) == "waiting: 0 0 7200");
    BOOST_TEST(core::waiting_message({3, std::nullopt}) == "waiting: 3 - -");
    BOOST_TEST(core::waiting_message({2, WaitRange{0s, 81s}, WaitReason::room}) == "waiting: 2 0 90 room");
    BOOST_TEST(core::waiting_message({2, std::nullopt, WaitReason::busy}) == "waiting: 2 - - busy");
    BOOST_TEST(core::waiting_message({2, WaitRange{62s, 236s}, WaitReason::suitable}) ==
               "waiting: 2 60 240 suitable");
    BOOST_TEST(core::waiting_message({2, std::nullopt, WaitReason::draining}) == "waiting: 2 - - draining");
    BOOST_TEST(core::waiting_message({0, std::nullopt, WaitReason::down}) == "waiting: 0 - - down");
    BOOST_TEST(core::waiting_ticket_message("abc") == "waitingTicket: abc");
    BOOST_TEST(core::turn_message() == "loading: A machine is free.");
}

BOOST_AUTO_TEST_CASE(who_waits_hears_what_for)
{
    struct Row
    {
        SiteState supply;
        bool wants_room;
        bool is_choosy;
        WaitReason why;
    };
    constexpr std::array rows{
        Row{SiteState::free, true, false, WaitReason::room},
        Row{SiteState::free, false, true, WaitReason::suitable},
        Row{SiteState::free, false, false, WaitReason::seat}, // it is the next one's in a moment
        Row{SiteState::busy, false, false, WaitReason::busy},
        Row{SiteState::busy, false, true, WaitReason::busy},
        Row{SiteState::full, false, true, WaitReason::seat},
        Row{SiteState::full, false, false, WaitReason::seat},
        Row{SiteState::unknown, false, false, WaitReason::seat},
        Row{SiteState::draining, false, false, WaitReason::draining},
        Row{SiteState::down, false, true, WaitReason::down},
    };
    for (auto const& row : rows)
        BOOST_TEST((core::wait_reason(row.supply, row.wants_room, row.is_choosy) == row.why),
                   core::word_of(row.supply)
                       << (row.wants_room ? " room" : "") << (row.is_choosy ? " choosy" : ""));
    for (auto const why : {WaitReason::room, WaitReason::busy, WaitReason::draining, WaitReason::down})
        BOOST_TEST(!core::ends_with_a_session(why));
}

BOOST_AUTO_TEST_SUITE_END()
