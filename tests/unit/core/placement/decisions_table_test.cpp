#include "core/placement/decisions_table.hpp"
#include "unit_test.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(decisions_as_a_table)

BOOST_AUTO_TEST_CASE(each_decision_is_a_line_and_the_same_refusals_are_one)
{
    std::string const refused =
        R"({"secondsAgo":70,"chosen":null,"offered":0,"refused":{"full":1,"load":2},"machines":[]})";
    auto const table = decisions_table(
        R"({"decisions":[{"secondsAgo":1.5,"chosen":"a:2000","offered":2,"refused":{"full":1},"machines":)"
        R"([{"server":"b:2000","load":99},{"server":"a:2000","load":12.3}]},)" +
        refused + "," + refused + "," + refused +
        R"(,{"secondsAgo":900,"chosen":null,"offered":1,"refused":{},"held":2,"freeSeats":3,"machines":[]}]})");
    BOOST_TEST(table == "WHEN        SENT TO          ITS LOAD  OFFERED  NOT OFFERED\n"
                        "1 s ago     a:2000           12%       2        full 1\n"
                        "70 s ago    nobody, 3 times            0        full 1, load 2\n"
                        "15 min ago  nobody                     1        2 of 3 free seats held for others\n"
                        "--decisions --json has all figures.",
               table);
}

BOOST_AUTO_TEST_CASE(without_a_decision_there_is_a_sentence)
{
    BOOST_TEST(decisions_table(R"({"decisions":[]})") == "Nobody has asked for a simulation yet.");
}

BOOST_AUTO_TEST_CASE(what_another_program_says_steers_no_terminal)
{
    BOOST_TEST(decisions_table("404: Not Found") == "404: Not Found");
    auto const table =
        decisions_table(R"({"decisions":[5,{"chosen":"\u001b[2J","refused":[],"machines":{}}]})");
    BOOST_TEST(table.find('\x1b') == std::string::npos);
}

BOOST_AUTO_TEST_SUITE_END()
