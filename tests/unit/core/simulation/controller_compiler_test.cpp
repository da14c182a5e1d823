#include "core/simulation/controller_compiler.hpp"
#include "unit_test.hpp"

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(controller_compiler)

namespace {

constexpr auto make = "/usr/bin/make";
constexpr auto home = "/opt/webots";
constexpr auto folder = "/i/controllers/drive";

} // namespace

BOOST_AUTO_TEST_CASE(a_makefile_of_the_project_goes_before_that_of_webots)
{
    std::vector<std::string> expected{make, "--no-print-directory", "-C", folder};
    BOOST_TEST(core::compile_command(make, home, folder, true) == expected, boost::test_tools::per_element());
    expected.insert(expected.end(), {"-f", "/opt/webots/resources/Makefile.include"});
    BOOST_TEST(core::compile_command(make, home, folder, false) == expected,
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(makefiles_find_webots_and_messages_are_english)
{
    auto const variables = core::compile_variables(home);
    BOOST_TEST((variables ==
                std::vector<std::pair<std::string, std::string>>{{"WEBOTS_HOME", home}, {"LC_ALL", "C"}}));
}

BOOST_AUTO_TEST_CASE(where_webots_is_on_this_machine_is_nobodys_business)
{
    BOOST_TEST(core::without_home("[/opt/webots/a:1] /opt/webots", home) ==
               "[$WEBOTS_HOME/a:1] $WEBOTS_HOME");
    BOOST_TEST(core::without_home("fly.c:1:2: error", home) == "fly.c:1:2: error");
}

BOOST_AUTO_TEST_SUITE_END()
