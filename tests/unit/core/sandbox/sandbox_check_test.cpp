#include "unit_test.hpp"

#include "core/sandbox/sandbox_check.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(sandbox_check)

BOOST_AUTO_TEST_CASE(a_sandbox_in_which_every_attempt_failed_is_good)
{
    BOOST_TEST(judge_sandbox("tried\n").has_value());
}

BOOST_AUTO_TEST_CASE(what_was_possible_is_said_in_words)
{
    auto const one = judge_sandbox("tried file\n");
    BOOST_TEST((one.error().code() == errc::refused));
    BOOST_TEST(one.error().message().find("a simulation could read files of the server") !=
               std::string::npos);
    auto const two = judge_sandbox("tried port write\n");
    BOOST_TEST(
        two.error().message().find("connect to services of this machine and change files of the system") !=
        std::string::npos);
    BOOST_TEST(judge_sandbox("tried process\n").has_error());
}

BOOST_AUTO_TEST_CASE(silence_and_nonsense_are_no_proof)
{
    for (auto const* said : {"", "\n", "bwrap: No permissions", "file"})
        BOOST_TEST((judge_sandbox(said).error().code() == errc::protocol_error), said);
}

BOOST_AUTO_TEST_CASE(the_attempts_are_arguments)
{
    BOOST_TEST((try_forbidden_things("/guard", "/state/file", 2000, 42) ==
                std::vector<std::string>{"/guard", "--try", "/state/file", "2000", "42"}));
}

BOOST_AUTO_TEST_SUITE_END()
