#include "unit_test.hpp"

#include "core/simulation/simulation_log.hpp"

using namespace webots_cloud::core;
using namespace std::chrono_literals;

// Protocol section 9.1; one log per simulation is ours.
BOOST_AUTO_TEST_SUITE(simulation_log)

BOOST_AUTO_TEST_CASE(a_name_says_when_and_which_and_nothing_else_passes_for_one)
{
    BOOST_TEST(simulation_log_name("2026-01-31 13:59:59", 7) == "2026-01-31_13-59-59_7.log");
    BOOST_TEST(is_simulation_log_name("2026-01-31_13-59-59_7.log"));
    BOOST_TEST(is_simulation_log_name("2026-01-31_13-59-59_1234567.log"));
    for (auto const* name :
         {"", ".log", "output.log", "2026-01-31_13-59-59_.log", "2026-01-31_13-59-59_7.txt",
          "2026-01-31_13-59-59_7/../x.log", "x026-01-31_13-59-59_7.log", "2026-01-31_13-59-59_7.log.1"})
        BOOST_TEST(!is_simulation_log_name(name), name);
}

BOOST_AUTO_TEST_CASE(a_short_output_is_written_as_it_comes)
{
    KeptOutput kept(100, 100);
    BOOST_TEST(kept.take("one") == "one\n");
    BOOST_TEST(kept.take("") == "\n");
    BOOST_TEST(kept.finish() == "");
}

BOOST_AUTO_TEST_CASE(of_a_flood_the_beginning_and_the_end_are_kept)
{
    KeptOutput kept(8, 12);
    std::string written;
    for (int i = 0; i < 100'000; ++i)
        written += kept.take("l" + std::to_string(i));
    written += kept.finish();
    BOOST_TEST(written == "l0\nl1\n[99997 lines are left out here]\nl99999\n");
}

BOOST_AUTO_TEST_CASE(an_end_that_fits_is_complete)
{
    KeptOutput kept(4, 8);
    BOOST_TEST(kept.take("abc") == "abc\n");
    BOOST_TEST(kept.take("def") == "");
    BOOST_TEST(kept.take("ghi") == "");
    BOOST_TEST(kept.finish() == "def\nghi\n");
}

BOOST_AUTO_TEST_CASE(logs_go_when_they_are_old_or_too_many_the_oldest_first)
{
    std::vector<SimulationLogFile> const files = {{"old", 50h}, {"new", 1h}, {"middle", 20h}, {"newest", 0h}};
    BOOST_TEST(outdated_logs(files, 100h, 10).empty());
    BOOST_TEST(outdated_logs(files, 48h, 10) == (std::vector<std::string>{"old"}),
               boost::test_tools::per_element());
    BOOST_TEST(outdated_logs(files, 48h, 2) == (std::vector<std::string>{"middle", "old"}),
               boost::test_tools::per_element());
    BOOST_TEST(outdated_logs(files, 0h, 10).size() == 3u);
}

BOOST_AUTO_TEST_SUITE_END()
