#include "playback.hpp"

#include <boost/test/unit_test.hpp>

#include <limits>

using namespace webots_cloud::demo;

BOOST_AUTO_TEST_SUITE(playback)

BOOST_AUTO_TEST_CASE(it_must_pause_when_its_deadline_has_passed_and_it_runs)
{
    Playback playback(Mode::real_time);
    BOOST_TEST(!playback.must_pause(1'000'000));
    playback.set_deadline(1000, 64);
    BOOST_TEST(!playback.must_pause(1063));
    BOOST_TEST(playback.must_pause(1064));
    playback.set_mode(Mode::pause);
    BOOST_TEST(!playback.must_pause(1064));
}

BOOST_AUTO_TEST_CASE(a_negative_duration_means_no_deadline)
{
    Playback playback(Mode::fast);
    playback.set_deadline(0, 0);
    BOOST_TEST(playback.must_pause(0));
    playback.set_deadline(0, -1);
    BOOST_TEST(!playback.must_pause(std::numeric_limits<std::int64_t>::max()));
}

BOOST_AUTO_TEST_CASE(huge_durations_do_not_overflow)
{
    Playback playback(Mode::fast);
    playback.set_deadline(1'000'000'000, std::numeric_limits<std::int64_t>::max());
    BOOST_TEST(!playback.must_pause(1'000'000'000));
}

BOOST_AUTO_TEST_CASE(the_state_frame_names_the_time_only_while_paused)
{
    BOOST_TEST(Playback(Mode::pause).state_text(96) == "pause: 96");
    BOOST_TEST(Playback(Mode::real_time).state_text(96) == "real-time");
    BOOST_TEST(Playback(Mode::fast).state_text(96) == "fast");
}

BOOST_AUTO_TEST_SUITE_END()
