#include "unit_test.hpp"

#include "core/projects/website_plan.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol sections 5.2 and 5.3.
BOOST_AUTO_TEST_SUITE(website_plan)

namespace {

WebsiteProject project()
{
    WebsiteProject project;
    project.origin = "http://w.org:8080";
    project.project = "robots";
    project.world = "a.wbt";
    return project;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_visitor_gets_the_template_and_the_website_is_not_asked)
{
    for (std::string const key : {"", "key"}) {
        auto const plan = plan_website_project(project(), key);
        BOOST_TEST_REQUIRE(plan.has_value());
        BOOST_TEST(plan->project == "robots");
        BOOST_TEST(plan->host_file == "http://w.org:8080");
        BOOST_TEST(!plan->download);
    }
}

BOOST_AUTO_TEST_CASE(for_a_user_the_website_is_asked_with_all_fields_and_the_key)
{
    auto user = project();
    user.user1_id = "0"; // counts as logged in
    user.user1_name = "Ada L";
    user.user1_authentication = "p&w=d";
    user.user2_id = "43";
    user.user2_name = "Bob\n";
    user.custom_data = "caf\u00e9";
    auto const plan = plan_website_project(user, "the key");
    BOOST_TEST_REQUIRE(plan.has_value());
    BOOST_TEST_REQUIRE(plan->download.has_value());
    BOOST_TEST(plan->download->url == "http://w.org:8080/ajax/download-project.php");
    BOOST_TEST(plan->download->form ==
               "project=robots&key=the%20key&user1Id=0&user1Name=Ada%20L&user1Authentication=p%26w%3Dd&"
               "user2Id=43&user2Name=Bob%0A&customData=caf%C3%A9");
}

BOOST_AUTO_TEST_CASE(a_website_without_a_key_is_never_asked)
{
    auto user = project();
    user.user1_id = "42";
    auto const plan = plan_website_project(user, "");
    BOOST_TEST_REQUIRE(plan.has_error());
    BOOST_TEST((plan.error() == errc::refused));
    BOOST_TEST(plan.error().message() ==
               "This simulation server has no key for w.org: its operator must file one before users "
               "of that website can start simulations.");
}

BOOST_AUTO_TEST_CASE(the_key_is_the_first_line_of_its_file)
{
    BOOST_TEST(website_key("abc") == "abc");
    BOOST_TEST(website_key("abc\n") == "abc");
    BOOST_TEST(website_key("abc\r\nnot this\n") == "abc");
    BOOST_TEST(website_key("") == "");
    BOOST_TEST(website_key("\nabc") == "");
}

BOOST_AUTO_TEST_CASE(answers_are_of_three_kinds)
{
    BOOST_TEST((classify_download("Error: no such directory: 'user/42/projects/robots'.") ==
                DownloadAnswer::unchanged));
    BOOST_TEST((classify_download("PK\5\6") == DownloadAnswer::unchanged));
    for (auto const* words :
         {"Error: Wrong key.", "Error:", "Error: Missing user1Id.", "Error: no such directory"})
        BOOST_TEST((classify_download(words) == DownloadAnswer::refused), words);
    for (auto const* bytes : {"PK\3\4", "", "<html>", "error: x"})
        BOOST_TEST((classify_download(bytes) == DownloadAnswer::archive), bytes);
}

BOOST_AUTO_TEST_CASE(a_refusal_is_told_in_the_websites_words)
{
    BOOST_TEST(download_refusal("Error: Wrong key.\n").message() == "Failed to download project: Wrong key.");
    BOOST_TEST(download_refusal("Error:\n").message() ==
               "Failed to download project: the website gives no reason.");
    BOOST_TEST(download_refusal("Error: \x1b[2J").message() == "Failed to download project: \\x1b[2J");
}

BOOST_AUTO_TEST_SUITE_END()
