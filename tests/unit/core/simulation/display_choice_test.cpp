#include "unit_test.hpp"

#include "core/simulation/display_choice.hpp"

using namespace webots_cloud::core;

// Protocol section 6.1: `DISPLAY`, and `xhost`.
BOOST_AUTO_TEST_SUITE(display_choice)

using Kind = DisplayChoice::Kind;

namespace {

DisplayChoice choice(std::string configured, std::string display, std::string ssh_connection = "")
{
    DisplayContext context;
    context.configured = std::move(configured);
    context.display = std::move(display);
    context.ssh_connection = std::move(ssh_connection);
    return choose_display(context);
}

} // namespace

BOOST_AUTO_TEST_CASE(the_configuration_comes_before_the_environment)
{
    BOOST_TEST(choice(":1", ":0").name == ":1");
    BOOST_TEST(choice("", ":0").name == ":0");
    BOOST_TEST(choice("", "").name == "");
}

BOOST_AUTO_TEST_CASE(a_screen_is_opened_to_containers_unless_the_login_is_over_ssh)
{
    BOOST_TEST(choice("", ":0").may_be_opened);
    BOOST_TEST(choice(":1", "").may_be_opened);
    BOOST_TEST(!choice("", "localhost:10.0", "10.0.0.1 50000 10.0.0.2 22").may_be_opened);
    BOOST_TEST(!choice(":1", "", "10.0.0.1 50000 10.0.0.2 22").may_be_opened);
    BOOST_TEST(!choice("", "").may_be_opened);
}

BOOST_AUTO_TEST_CASE(what_the_operator_has_asked_for_is_not_replaced)
{
    for (auto const& [configured, kind] :
         {std::pair("private", Kind::own), std::pair("none", Kind::none), std::pair(":1", Kind::shared)}) {
        auto const chosen = choice(configured, ":0");
        BOOST_TEST((chosen.kind == kind), configured);
        BOOST_TEST(chosen.is_configured);
        BOOST_TEST(chosen.may_be_opened == (kind == Kind::shared));
    }
    BOOST_TEST(!choice("", ":0").is_configured);
}

BOOST_AUTO_TEST_CASE(without_a_screen_each_simulation_has_a_display_of_its_own_where_that_is_possible)
{
    DisplayContext context;
    BOOST_TEST((choose_display(context).kind == Kind::shared));
    context.may_be_private = true;
    BOOST_TEST((choose_display(context).kind == Kind::own));
    context.has_screen = true;
    BOOST_TEST((choose_display(context).kind == Kind::shared));
    context.has_screen = false;
    context.display = ":7";
    BOOST_TEST((choose_display(context).kind == Kind::shared));
}

BOOST_AUTO_TEST_SUITE_END()
