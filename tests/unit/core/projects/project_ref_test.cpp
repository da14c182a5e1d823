#include "unit_test.hpp"

#include <webots_cloud/project_ref.hpp>

using namespace webots_cloud;

// Protocol section 4.1.2, steps 2 and 5, section 13 (forges), and quirks Q5 and Q25.
BOOST_AUTO_TEST_SUITE(world_url)

namespace {

std::vector<std::string> const forges{"https://github.com", "http://localhost:8080/git"};

std::string refusal_of(std::string_view url)
{
    auto const parsed = parse_world_url(url, forges);
    BOOST_TEST_REQUIRE(!parsed);
    BOOST_TEST((parsed.error() == errc::invalid_url));
    return parsed.error().message();
}

} // namespace

BOOST_AUTO_TEST_CASE(a_world_at_the_root_of_a_repository)
{
    auto const project =
        parse_world_url("https://github.com/owner/repo/blob/main/worlds/a.wbt", forges).value();
    BOOST_TEST(project.forge == "https://github.com");
    BOOST_TEST(project.owner == "owner");
    BOOST_TEST(project.repository == "repo");
    BOOST_TEST(project.ref_and_folder == "main");
    BOOST_TEST(project.world == "a.wbt");
    BOOST_TEST(project.clone_url() == "https://github.com/owner/repo.git");
}

BOOST_AUTO_TEST_CASE(folders_and_slashes_in_the_ref_stay_together_for_the_repository_to_split)
{
    auto const project =
        parse_world_url("https://github.com/o/r/tree/feature/x/projects/p07/worlds/demo.wbt", forges).value();
    BOOST_TEST(project.ref_and_folder == "feature/x/projects/p07");
}

BOOST_AUTO_TEST_CASE(a_configured_forge_may_have_a_port_a_path_and_plain_http)
{
    auto const project =
        parse_world_url("http://localhost:8080/git/o/r/blob/main/worlds/a.wbt", forges).value();
    BOOST_TEST(project.clone_url() == "http://localhost:8080/git/o/r.git");
}

BOOST_AUTO_TEST_CASE(percent_encoding_is_decoded_once)
{
    BOOST_TEST(
        parse_world_url("https://github.com/o/r/blob/main/my%20worlds/worlds/a%20b.wbt", forges)->world ==
        "a b.wbt");
    BOOST_TEST(parse_world_url("https://github.com/o/r/blob/main/worlds/a%2520b.wbt", forges)->world ==
               "a%20b.wbt");
    BOOST_TEST(refusal_of("https://github.com/o/r/blob/main/worlds/a%2.wbt") ==
               "Wrong Webots simulation URL: malformed percent-encoding");
}

BOOST_AUTO_TEST_CASE(query_and_fragment_are_ignored)
{
    BOOST_TEST(parse_world_url("https://github.com/o/r/blob/main/worlds/a.wbt?raw=1#L3", forges)->world ==
               "a.wbt");
}

BOOST_AUTO_TEST_CASE(the_error_texts_are_those_browsers_know)
{
    BOOST_TEST(refusal_of("https://github.com/o/r/blob/a.wbt") == "Wrong Webots simulation URL");
    BOOST_TEST(refusal_of("https://github.com/o/r/raw/main/worlds/a.wbt") ==
               "Missing blob in Webots simulation URL, founds raw");
    BOOST_TEST(refusal_of("https://github.com/o/r/blob/main/world/a.wbt") ==
               "Missing worlds folder in Webots simulation URL");
    BOOST_TEST(refusal_of("https://github.com/o/r/blob/main/worlds/a.txt") ==
               "Missing world file in Webots simulation URL");
    BOOST_TEST(refusal_of("https://github.com/o/r/blob/main/worlds/.wbt") ==
               "Missing world file in Webots simulation URL");
    BOOST_TEST(refusal_of("https://gitlab.com/o/r/blob/main/worlds/a.wbt")
                   .starts_with("Unsupported URL protocol: "));
}

BOOST_AUTO_TEST_CASE(a_forge_is_a_whole_prefix_and_never_a_part_of_a_name)
{
    for (auto const* url :
         {"https://github.com.evil.org/o/r/blob/main/worlds/a.wbt",
          "https://github.com@evil.org/o/r/blob/main/worlds/a.wbt",
          "http://github.com/o/r/blob/main/worlds/a.wbt", "file:///o/r/blob/main/worlds/a.wbt",
          "https://github.com:443/o/r/blob/main/worlds/a.wbt"})
        BOOST_TEST(refusal_of(url).starts_with("Unsupported URL protocol: "), url);
}

BOOST_AUTO_TEST_CASE(the_forge_is_known_before_the_rest_is_understood)
{
    BOOST_TEST(forge_of("https://github.com/o/r/raw", forges).value() == "https://github.com");
    BOOST_TEST(forge_of("http://localhost:8080/git/", forges).value() == "http://localhost:8080/git");
    BOOST_TEST(
        forge_of("https://github.com", forges).error().message().starts_with("Unsupported URL protocol: "));
}

BOOST_AUTO_TEST_CASE(all_forges_are_named_to_who_comes_from_another)
{
    BOOST_TEST(forge_of("ftp://x/y", {"https://github.com", "local:"}).error().message() ==
               "Unsupported URL protocol: ftp://x/y. The URL must start with https://github.com/ or local:/");
}

BOOST_AUTO_TEST_CASE(shell_text_options_and_traversal_are_refused)
{
    for (auto const* url : {
             "https://github.com/$(id)/r/blob/main/worlds/a.wbt",
             "https://github.com/o/r`id`/blob/main/worlds/a.wbt",
             "https://github.com/o/./blob/main/worlds/a.wbt",
             "https://github.com/o/.git/blob/main/worlds/a.wbt",
             "https://github.com/o/h%C3%B6he/blob/main/worlds/a.wbt",
             "https://github.com/--upload-pack=x/r/blob/main/worlds/a.wbt",
             "https://github.com/../r/blob/main/worlds/a.wbt",
             "https://github.com/o/r/blob/main/../../worlds/a.wbt",
             "https://github.com/o/r/blob/main/%2e%2e/worlds/a.wbt",
             "https://github.com/o/r/blob/main/..%2f..%2fetc/worlds/a.wbt",
             "https://github.com/o/r.git/blob/main/worlds/a.wbt",
             "https://github.com/o/r.GIT/blob/main/worlds/a.wbt",
             "https://github.com/o/r.gIt/blob/main/worlds/a.wbt",
             "https://github.com/o/r%2egit/blob/main/worlds/a.wbt",
             "https://github.com/o/r/blob/main/.git/worlds/a.wbt",
             "https://github.com/o/r/blob/main/.GIT/worlds/a.wbt",
             "https://github.com/o/r/blob/main/.git./worlds/a.wbt",
             "https://github.com/o/r/blob/main/git~1/worlds/a.wbt",
             "https://github.com/o/r/blob/main//worlds/a.wbt",
             "https://github.com/o/r/blob/main/worlds/a%0ab.wbt",
             "https://github.com/o/r/blob/main/worlds/a%00.wbt",
             "https://github.com/o/r/blob/main/worlds/a%5cb.wbt",
             "https://github.com/o/r/blob/main/worlds/%ff.wbt",
         })
        BOOST_TEST(refusal_of(url).starts_with("Wrong Webots simulation URL"), url);
}

// GitHub makes a hyphen of each letter of a name that is not ASCII; a user's profile and a site's settings
// are in repositories such as
// `.github`; groups of GitLab have the longest names.
BOOST_AUTO_TEST_CASE(names_that_some_forge_allows_are_names)
{
    for (std::string const name :
         {"-", "--", "-r", "_", "r-", "1", ".github", "r.js", "a--b", "...", "Icon_", "a.b-c_d"}) {
        auto const project =
            parse_world_url("https://github.com/o/" + name + "/blob/main/worlds/a.wbt", forges);
        BOOST_TEST_REQUIRE(project.has_value(), name);
        BOOST_TEST(project->clone_url() == "https://github.com/o/" + name + ".git");
        BOOST_TEST(
            parse_world_url("https://github.com/" + name + "/r/blob/main/worlds/a.wbt", forges).has_value(),
            name);
    }
    auto const address = [](std::size_t size) {
        return "https://github.com/" + std::string(size, 'a') + "/r/blob/main/worlds/a.wbt";
    };
    BOOST_TEST(parse_world_url(address(255), forges).has_value());
    BOOST_TEST(!parse_world_url(address(256), forges).has_value());
}

BOOST_AUTO_TEST_CASE(endless_urls_are_refused)
{
    auto const url = "https://github.com/o/r/blob/main/" + std::string(5000, 'a') + "/worlds/a.wbt";
    BOOST_TEST(refusal_of(url) == "Wrong Webots simulation URL: longer than 2048 characters");
}

BOOST_AUTO_TEST_SUITE_END()
