#include "adapters/process/program_output.hpp"
#include "unit_test.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(program_output)

BOOST_AUTO_TEST_CASE(a_program_that_closes_its_output_is_waited_for_and_ended_at_the_limit)
{
    auto const soon = adapters::run_program({"/bin/sh", "-c", "echo a; exec >&- 2>&-; exit 3"}, 60s);
    BOOST_TEST_REQUIRE(soon.has_value());
    BOOST_TEST(soon->status == 3);
    BOOST_TEST(soon->output == "a\n");
    auto const never = adapters::run_program({"/bin/sh", "-c", "exec >&- 2>&-; exec sleep 1000"}, 100ms);
    BOOST_TEST((never.error() == errc::timed_out));
}

BOOST_AUTO_TEST_SUITE_END()
