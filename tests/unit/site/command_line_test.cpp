#include "site/command_line.hpp"

#include "unit_test.hpp"

namespace webots_cloud::site {

BOOST_AUTO_TEST_SUITE(site_command_line)

BOOST_AUTO_TEST_CASE(a_start_may_have_a_name_and_a_port)
{
    BOOST_TEST((parse_command_line({"start"}).verb == Verb::start));
    auto const line = parse_command_line({"restart", "--port", "3000", "--lan"});
    BOOST_TEST((line.verb == Verb::restart));
    BOOST_TEST(line.name == "lan");
    BOOST_TEST(line.port == 3000);
    BOOST_TEST(parse_command_line({"stop", "my_site.2-b"}).name == "my_site.2-b");
}

BOOST_AUTO_TEST_CASE(what_is_not_understood_is_refused_in_a_sentence)
{
    BOOST_TEST(!parse_command_line({}).complaint.empty());
    BOOST_TEST(!parse_command_line({"begin"}).complaint.empty());
    BOOST_TEST(!parse_command_line({"start", "a", "b"}).complaint.empty());
    BOOST_TEST(!parse_command_line({"stop", "--port", "3000"}).complaint.empty());
    BOOST_TEST(!parse_command_line({"start", "--port"}).complaint.empty());
    BOOST_TEST(parse_command_line({"start", "--port", "70000"}).complaint ==
               "Expected a port after --port, from 1 to 65535, found \"70000\".");
    BOOST_TEST(parse_command_line({"start", "../x"}).complaint ==
               "Expected the name of a configuration, found \"../x\".");
}

BOOST_AUTO_TEST_SUITE_END()

} // namespace webots_cloud::site
