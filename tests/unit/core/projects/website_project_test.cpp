#include "unit_test.hpp"

#include <webots_cloud/website_project.hpp>

using namespace webots_cloud;

// Protocol section 5.1.
BOOST_AUTO_TEST_SUITE(website_project)

namespace {

using Elements = std::vector<std::string>;

Elements const nine{"https://robotbenchmark.net",
                    "robot_programming",
                    "square.wbt",
                    "42",
                    "Ada",
                    "secret",
                    "43",
                    "Bob",
                    "a=b&c"};

std::string complaint(Elements const& elements)
{
    auto const project = parse_init(elements);
    return project ? "" : project.error().message();
}

} // namespace

BOOST_AUTO_TEST_CASE(nine_elements_are_host_project_world_two_users_and_custom_data)
{
    auto const project = parse_init(nine);
    BOOST_TEST_REQUIRE(project.has_value());
    BOOST_TEST(project->origin == "https://robotbenchmark.net");
    BOOST_TEST(project->project == "robot_programming");
    BOOST_TEST(project->world == "square.wbt");
    BOOST_TEST(project->user1_id == "42");
    BOOST_TEST(project->user1_name == "Ada");
    BOOST_TEST(project->user1_authentication == "secret");
    BOOST_TEST(project->user2_id == "43");
    BOOST_TEST(project->user2_name == "Bob");
    BOOST_TEST(project->custom_data == "a=b&c");
    BOOST_TEST(project->url() == "https://robotbenchmark.net/robot_programming/worlds/square.wbt");
}

BOOST_AUTO_TEST_CASE(three_to_nine_elements_are_understood_and_missing_ones_are_empty)
{
    for (std::size_t count = 0; count <= 12; ++count) {
        auto elements = nine;
        elements.resize(count, "x");
        BOOST_TEST(parse_init(elements).has_value() == (count >= 3 && count <= 9), count);
    }
    BOOST_TEST(parse_init({nine[0], nine[1], nine[2]})->user1_id == "");
    BOOST_TEST(complaint({}) == "\"init\" must have three to nine elements, not 0");
}

BOOST_AUTO_TEST_CASE(the_host_is_the_origin_without_scheme_and_port)
{
    for (auto const& [origin, host] : std::initializer_list<std::pair<char const*, char const*>>{
             {"https://robotbenchmark.net", "robotbenchmark.net"},
             {"http://localhost:8080", "localhost"},
             {"http://127.0.0.1:1", "127.0.0.1"},
             {"HTTPS://RobotBenchmark.NET:65535", "robotbenchmark.net"},
             {"http://my_host", "my_host"}}) {
        auto const project = parse_init({origin, "p", "a.wbt"});
        BOOST_TEST_REQUIRE(project.has_value(), origin);
        BOOST_TEST(project->host() == host);
    }
}

// Section 6.2.
BOOST_AUTO_TEST_CASE(controllers_are_edited_by_visitors_and_by_users_who_prove_themselves)
{
    WebsiteProject project;
    BOOST_TEST(project.may_edit());
    project.user1_id = "42";
    BOOST_TEST(!project.may_edit());
    project.user1_authentication = "secret";
    BOOST_TEST(project.may_edit());
}

// Quirk Q26: the host became the name of a file.
BOOST_AUTO_TEST_CASE(hosts_that_are_no_names_are_refused)
{
    for (std::string const origin : {"",
                                     "robotbenchmark.net",
                                     "ftp://w.org",
                                     "https://",
                                     "https://..",
                                     "https://../../etc/passwd",
                                     "https://.hidden",
                                     "https://w.org/x",
                                     "https://w.org:",
                                     "https://w.org:65536",
                                     "https://w.org:0443",
                                     "https://w.org:8o",
                                     "https://user@w.org",
                                     "https://w org",
                                     "https://w..org",
                                     "https://-option",
                                     "https://w.org\n",
                                     "https://[::1]",
                                     "https://w.org?x",
                                     "https://w.org#x",
                                     "https://caf\u00e9.fr",
                                     "file:///etc",
                                     "//w.org"})
        BOOST_TEST(complaint({origin, "p", "a.wbt"})
                       .ends_with("is no address of a website, such as https://example.org"),
                   origin);
    BOOST_TEST(!parse_init({"https://" + std::string(70, 'a'), "p", "a.wbt"}));
    BOOST_TEST(!parse_init({std::string("https://w.org\0", 14), "p", "a.wbt"}));
}

BOOST_AUTO_TEST_CASE(projects_are_folders_that_stay_inside)
{
    BOOST_TEST(parse_init({nine[0], "benchmarks/square one", "a.wbt"})->project == "benchmarks/square one");
    for (std::string const project :
         {"", "..", ".", "../x", "x/..", "x/../y", "/etc", "x//y", "x/", ".git", "a\\b", "a\nb", "\xff"})
        BOOST_TEST(complaint({nine[0], project, "a.wbt"}).ends_with("is no name of a project"), project);
    BOOST_TEST(!parse_init({nine[0], std::string(256, 'a'), "a.wbt"}));
}

BOOST_AUTO_TEST_CASE(worlds_are_files_of_the_folder_worlds)
{
    BOOST_TEST(parse_init({nine[0], "p", "my world.wbt"})->world == "my world.wbt");
    for (std::string const world :
         {"", ".wbt", "a", "a.proto", "../a.wbt", "sub/a.wbt", "a\\b.wbt", "a\n.wbt"})
        BOOST_TEST(complaint({nine[0], "p", world}).ends_with("is no name of a world file"), world);
}

BOOST_AUTO_TEST_SUITE_END()
