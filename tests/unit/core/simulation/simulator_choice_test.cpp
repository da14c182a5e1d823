#include "unit_test.hpp"

#include "core/simulation/simulator_choice.hpp"

#include <set>

using namespace webots_cloud;
using core::choose_simulator;

// Protocol section 6.1, and `webotsHome` of section 8.2.
BOOST_AUTO_TEST_SUITE(simulator_choice)

namespace {

std::function<bool(std::filesystem::path const&)> only(std::set<std::string> programs)
{
    return [programs = std::move(programs)](std::filesystem::path const& path) {
        return programs.contains(path.string());
    };
}

} // namespace

BOOST_AUTO_TEST_CASE(the_configured_webots_comes_first)
{
    for (auto const* const of_environment : {"/env/w", "/nowhere", ""}) {
        auto const choice =
            choose_simulator("/opt/w", of_environment, "/bin", only({"/opt/w/webots", "/env/w/webots"}))
                .value();
        BOOST_TEST(choice.program == "/opt/w/webots");
        BOOST_TEST(choice.home == "/opt/w");
        BOOST_TEST(choice.notice.empty());
    }
}

BOOST_AUTO_TEST_CASE(without_it_the_webots_of_the_environment_runs)
{
    auto const choice =
        choose_simulator({}, "/env/w", "/bin", only({"/env/w/webots", "/usr/bin/webots"})).value();
    BOOST_TEST(choice.program == "/env/w/webots");
}

BOOST_AUTO_TEST_CASE(no_other_simulator_runs_in_the_place_of_the_one_that_is_named)
{
    auto const others = only({"/env/w/webots", "/usr/bin/webots", "/bin/webots-demo-simulator"});
    auto const configured = choose_simulator("/opt/w", "/env/w", "/bin", others);
    BOOST_TEST((configured.error() == errc::invalid_config));
    BOOST_TEST(configured.error().message() ==
               "key \"webotsHome\": /opt/w/webots is missing or not executable. "
               "Name the folder of Webots that has it, or remove the key: "
               "then Webots is looked for in its usual places");
    auto const of_environment = choose_simulator({}, "/opt/w", "/bin", others);
    BOOST_TEST((of_environment.error() == errc::invalid_config));
    BOOST_TEST(of_environment.error().message() ==
               "WEBOTS_HOME of the environment: /opt/w/webots is missing or "
               "not executable. Name the folder of Webots that has it, or "
               "unset it: then Webots is looked for in its usual places");
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
    BOOST_TEST(choice.notice.find("(looked at /usr/local/webots/webots, /usr/bin/webots)") !=
               std::string::npos); // each once
}

BOOST_AUTO_TEST_CASE(with_neither_the_error_says_where_was_looked)
{
    auto const choice = choose_simulator({}, {}, "/bin", only({}));
    BOOST_TEST((choice.error() == errc::not_found));
    BOOST_TEST(choice.error().message().find(
                   "/usr/local/webots/webots, /usr/bin/webots, and no demo simulator at /bin/") !=
               std::string::npos);
}

BOOST_AUTO_TEST_SUITE_END()
