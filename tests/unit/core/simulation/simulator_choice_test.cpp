#include "unit_test.hpp"

#include "core/simulation/simulator_choice.hpp"

#include <set>

using namespace webots_cloud;
using core::choose_simulator;

namespace {

std::function<bool(std::filesystem::path const&)> only(std::set<std::string> programs)
{
    return [programs = std::move(programs)](std::filesystem::path const& path) { return programs.contains(path.string()); };
}

} // namespace

// Protocol section 6.1, and `webotsHome` of section 8.2.
BOOST_AUTO_TEST_SUITE(simulator_choice)

BOOST_AUTO_TEST_CASE(the_configured_webots_comes_first)
{
    auto const choice = choose_simulator("/opt/w", "/env/w", "/bin", only({"/opt/w/webots", "/env/w/webots"})).value();
    BOOST_TEST(choice.program == "/opt/w/webots");
    BOOST_TEST(choice.notice.empty());
}

BOOST_AUTO_TEST_CASE(another_webots_than_the_configured_one_is_said)
{
    auto const choice = choose_simulator("/opt/w", "/env/w", "/bin", only({"/env/w/webots"})).value();
    BOOST_TEST(choice.program == "/env/w/webots");
    BOOST_TEST(choice.notice == "There is no Webots at /opt/w/webots: running /env/w/webots.");
}

BOOST_AUTO_TEST_CASE(a_webots_home_of_the_environment_that_has_no_webots_is_said)
{
    auto const choice = choose_simulator({}, "/env/w", "/bin", only({"/usr/bin/webots"})).value();
    BOOST_TEST(choice.notice == "There is no Webots at /env/w/webots: running /usr/bin/webots.");
}

BOOST_AUTO_TEST_CASE(unless_configured_webots_is_where_it_is_usually_installed)
{
    for (std::string const usual : {"/usr/local/webots/webots", "/usr/bin/webots"}) {
        auto const choice =
            choose_simulator({}, {}, "/bin", only({usual, "/bin/webots-demo-simulator"})).value();
        BOOST_TEST(choice.program == usual);
        BOOST_TEST(choice.notice.empty());
    }
}

BOOST_AUTO_TEST_CASE(without_webots_the_demo_simulator_runs_and_says_that_it_is_not_webots)
{
    auto const choice = choose_simulator({}, {}, "/bin", only({"/bin/webots-demo-simulator"})).value();
    BOOST_TEST(choice.program == "/bin/webots-demo-simulator");
    BOOST_TEST(choice.notice.find("is not Webots") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(with_neither_the_error_says_where_was_looked)
{
    auto const choice = choose_simulator("/opt/w", {}, "/bin", only({}));
    BOOST_TEST((choice.error() == errc::not_found));
    BOOST_TEST(choice.error().message().find("/opt/w/webots") != std::string::npos);
}

BOOST_AUTO_TEST_SUITE_END()
