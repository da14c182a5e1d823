#include "core/simulation/controller_compiler.hpp"
#include "unit_test.hpp"

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(controller_compiler)

namespace {

ControllerCompiler webots()
{
    ControllerCompiler compiler;
    compiler.make = "/usr/bin/make";
    compiler.home = "/opt/webots";
    return compiler;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_makefile_of_the_project_goes_before_that_of_webots)
{
    std::vector<std::string> expected{"/usr/bin/make", "--no-print-directory", "-C", "/i/controllers/drive"};
    ControllerSources sources("drive", "/i/controllers/drive", true);
    BOOST_TEST(core::compile_command(webots(), sources) == expected, boost::test_tools::per_element());
    sources.has_makefile = false;
    expected.insert(expected.end(), {"-f", "/opt/webots/resources/Makefile.include"});
    BOOST_TEST(core::compile_command(webots(), sources) == expected, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(makefiles_find_webots_and_messages_are_english)
{
    auto const variables = core::compile_variables(webots());
    BOOST_TEST((variables == std::vector<std::pair<std::string, std::string>>{{"WEBOTS_HOME", "/opt/webots"},
                                                                              {"LC_ALL", "C"}}));
}

BOOST_AUTO_TEST_SUITE_END()
