#include "unit_test.hpp"

#include "core/simulation/display_choice.hpp"

using webots_cloud::core::choose_display;

// Protocol section 6.1: `DISPLAY`, and `xhost`.
BOOST_AUTO_TEST_SUITE(display_choice)

BOOST_AUTO_TEST_CASE(the_configuration_comes_before_the_environment)
{
    BOOST_TEST(choose_display(":1", ":0", "").name == ":1");
    BOOST_TEST(choose_display("", ":0", "").name == ":0");
    BOOST_TEST(choose_display("", "", "").name == "");
}

BOOST_AUTO_TEST_CASE(a_screen_is_opened_to_containers_unless_the_login_is_over_ssh)
{
    BOOST_TEST(choose_display("", ":0", "").may_be_opened);
    BOOST_TEST(choose_display(":1", "", "").may_be_opened);
    BOOST_TEST(!choose_display("", "localhost:10.0", "10.0.0.1 50000 10.0.0.2 22").may_be_opened);
    BOOST_TEST(!choose_display(":1", "", "10.0.0.1 50000 10.0.0.2 22").may_be_opened);
    BOOST_TEST(!choose_display("", "", "").may_be_opened);
}

BOOST_AUTO_TEST_SUITE_END()
