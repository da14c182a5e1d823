#include "refusal_sentences.hpp"
#include "unit_test.hpp"

#include <webots_cloud/project_ref.hpp>

using namespace webots_cloud;

// Protocol section 4.1.2, steps 2 and 5, section 13 (forges), and quirks Q5 and Q25.
BOOST_AUTO_TEST_SUITE(world_url)

namespace {

std::vector<ForgeAddress> const forges{"https://github.com", "http://localhost:8080/git"};

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
    BOOST_TEST(project.folder_after_ref() == "");
    BOOST_TEST(project.world == "a.wbt");
    BOOST_TEST(project.clone_url() == "https://github.com/owner/repo.git");
}

BOOST_AUTO_TEST_CASE(folders_and_slashes_in_the_ref_stay_together_for_the_repository_to_split)
{
    auto const project =
        parse_world_url("https://github.com/o/r/tree/feature/x/projects/p07/worlds/demo.wbt", forges).value();
    BOOST_TEST(project.ref_and_folder == "feature/x/projects/p07");
    BOOST_TEST(project.folder_after_ref() == "/x/projects/p07");
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
    BOOST_TEST(refusal_of("https://github.com/o/r/commits/main/worlds/a.wbt") ==
               "Missing blob in Webots simulation URL, founds commits");
    BOOST_TEST(refusal_of("https://github.com/o/r/blob/main/world/a.wbt")
                   .starts_with(sentence(core::Refused::address_without_worlds)));
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
    BOOST_TEST(forge_of("https://github.com/o/r/raw", forges).value().url == "https://github.com");
    BOOST_TEST(forge_of("http://localhost:8080/git/", forges).value().url == "http://localhost:8080/git");
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

namespace {

/// `<clone address> <ref and folder> <world>`
std::string read(std::string_view url, ForgeAddress const& forge)
{
    auto const project = parse_world_url(url, {forge});
    return project ? project->clone_url() + " " + project->ref_and_folder + " " + project->world
                   : project.error().message();
}

struct Link
{
    ForgeAddress forge;
    std::string url;
    std::string expected;
};

} // namespace

// As people copy them: from the address bar, and from the buttons for raw files, permanent links and history.
BOOST_AUTO_TEST_CASE(links_of_every_forge_are_understood)
{
    std::string const hash = "0123456789abcdef0123456789abcdef01234567";
    ForgeAddress const github("https://github.com");
    ForgeAddress const gitlab("https://gitlab.com");
    ForgeAddress const codeberg("https://codeberg.org");
    ForgeAddress const bitbucket("https://bitbucket.org");
    ForgeAddress const own("https://git.lab.org/code");
    std::vector<Link> const links{
        {github, "https://github.com/o/r/raw/main/p/worlds/a.wbt", "https://github.com/o/r.git main/p a.wbt"},
        {github, "https://github.com/o/r/raw/refs/heads/main/worlds/a.wbt",
         "https://github.com/o/r.git refs/heads/main a.wbt"},
        {github, "https://github.com/o/r/blame/main/worlds/a.wbt#L3",
         "https://github.com/o/r.git main a.wbt"},
        {github, "https://github.com/o/r/edit/main/worlds/a.wbt", "https://github.com/o/r.git main a.wbt"},
        {github, "https://github.com/o/-/blob/main/worlds/a.wbt", "https://github.com/o/-.git main a.wbt"},
        {github, "https://github.com/-o/-r/raw/main/worlds/a.wbt", "https://github.com/-o/-r.git main a.wbt"},
        {github, "https://github.com/o/blob/blob/main/worlds/a.wbt",
         "https://github.com/o/blob.git main a.wbt"},
        {github, "https://github.com/raw/src/tree/main/worlds/a.wbt",
         "https://github.com/raw/src.git main a.wbt"},
        {github, "https://github.com/o/r/blob/main/-/tree/x/worlds/a.wbt",
         "https://github.com/o/r.git main/-/tree/x a.wbt"},
        {github, "https://github.com/o/r/raw/branch/x/worlds/a.wbt",
         "https://github.com/o/r.git branch/x a.wbt"},
        {github, "https://raw.githubusercontent.com/o/r/main/p/worlds/a.wbt?token=x",
         "https://github.com/o/r.git main/p a.wbt"},
        {github, "https://raw.githubusercontent.com/-o/-r/refs/heads/main/worlds/a%20b.wbt",
         "https://github.com/-o/-r.git refs/heads/main a b.wbt"},
        {github, "https://media.githubusercontent.com/media/o/r/main/worlds/a.wbt",
         "https://github.com/o/r.git main a.wbt"},
        {github, "https://github.dev/o/r/blob/main/worlds/a.wbt", "https://github.com/o/r.git main a.wbt"},
        {gitlab, "https://gitlab.com/g/r/-/blob/main/worlds/a.wbt?ref_type=heads",
         "https://gitlab.com/g/r.git main a.wbt"},
        {gitlab, "https://gitlab.com/g/of/groups/r/-/blob/feature/x/p/worlds/a.wbt",
         "https://gitlab.com/g/of/groups/r.git feature/x/p a.wbt"},
        {gitlab, "https://gitlab.com/g/s/r/-/raw/main/worlds/a.wbt?inline=false",
         "https://gitlab.com/g/s/r.git main a.wbt"},
        {gitlab, "https://gitlab.com/g/s/r/-/tree/" + hash + "/worlds/a.wbt",
         "https://gitlab.com/g/s/r.git " + hash + " a.wbt"},
        {gitlab, "https://gitlab.com/g/s/r/-/blame/main/worlds/a.wbt",
         "https://gitlab.com/g/s/r.git main a.wbt"},
        {gitlab, "https://gitlab.com/-g/-s/-r/-/blob/main/worlds/a.wbt",
         "https://gitlab.com/-g/-s/-r.git main a.wbt"},
        {gitlab, "https://gitlab.com/g/src/media/r/-/blob/main/worlds/a.wbt",
         "https://gitlab.com/g/src/media/r.git main a.wbt"},
        {gitlab, "https://gitlab.com/g/r/blob/main/worlds/a.wbt", "https://gitlab.com/g/r.git main a.wbt"},
        {gitlab, "https://gitlab.com/g/s/r/blob/main/worlds/a.wbt",
         "https://gitlab.com/g/s/r.git main a.wbt"},
        {codeberg, "https://codeberg.org/o/r/src/branch/feature/x/worlds/a.wbt",
         "https://codeberg.org/o/r.git feature/x a.wbt"},
        {codeberg, "https://codeberg.org/o/r/src/tag/v1.0/p/worlds/a.wbt",
         "https://codeberg.org/o/r.git refs/tags/v1.0/p a.wbt"},
        {codeberg, "https://codeberg.org/o/r/src/commit/" + hash + "/worlds/a.wbt",
         "https://codeberg.org/o/r.git " + hash + " a.wbt"},
        {codeberg, "https://codeberg.org/o/r/raw/branch/main/worlds/a.wbt",
         "https://codeberg.org/o/r.git main a.wbt"},
        {codeberg, "https://codeberg.org/o/r/raw/tag/v1/worlds/a.wbt",
         "https://codeberg.org/o/r.git refs/tags/v1 a.wbt"},
        {codeberg, "https://codeberg.org/o/r/media/branch/main/worlds/a.wbt",
         "https://codeberg.org/o/r.git main a.wbt"},
        {codeberg, "https://codeberg.org/-o/-r/src/branch/-b/worlds/a.wbt",
         "https://codeberg.org/-o/-r.git -b a.wbt"},
        {codeberg, "https://codeberg.org/o/r/src/branch/branch/worlds/a.wbt",
         "https://codeberg.org/o/r.git branch a.wbt"},
        {codeberg, "https://codeberg.org/o/r/blob/main/worlds/a.wbt",
         "https://codeberg.org/o/r.git main a.wbt"},
        {bitbucket, "https://bitbucket.org/o/r/src/main/p/worlds/a.wbt",
         "https://bitbucket.org/o/r.git main/p a.wbt"},
        {bitbucket, "https://bitbucket.org/o/r/src/feature%2Fx/worlds/a.wbt",
         "https://bitbucket.org/o/r.git feature/x a.wbt"},
        {bitbucket, "https://bitbucket.org/o/r/src/" + hash + "/worlds/a.wbt?at=main",
         "https://bitbucket.org/o/r.git " + hash + " a.wbt"},
        {bitbucket, "https://bitbucket.org/o/r/raw/main/worlds/a.wbt",
         "https://bitbucket.org/o/r.git main a.wbt"},
        {bitbucket, "https://bitbucket.org/o/r/src/branch/x/worlds/a.wbt",
         "https://bitbucket.org/o/r.git branch/x a.wbt"},
        // Found out of the link.
        {own, "https://git.lab.org/code/o/r/blob/main/worlds/a.wbt",
         "https://git.lab.org/code/o/r.git main a.wbt"},
        {own, "https://git.lab.org/code/g/s/r/-/raw/main/worlds/a.wbt",
         "https://git.lab.org/code/g/s/r.git main a.wbt"},
        {own, "https://git.lab.org/code/g/s/src/r/-/blob/main/worlds/a.wbt",
         "https://git.lab.org/code/g/s/src/r.git main a.wbt"},
        {own, "https://git.lab.org/code/o/r/src/branch/main/worlds/a.wbt",
         "https://git.lab.org/code/o/r.git main a.wbt"},
        {own, "https://git.lab.org/code/o/r/src/tag/v1/worlds/a.wbt",
         "https://git.lab.org/code/o/r.git refs/tags/v1 a.wbt"},
        {own, "https://git.lab.org/code/o/r/src/main/worlds/a.wbt",
         "https://git.lab.org/code/o/r.git main a.wbt"},
        // Said by the operator.
        {ForgeAddress("https://b.lab.org", ForgeKind::bitbucket),
         "https://b.lab.org/o/r/src/tag/x/worlds/a.wbt", "https://b.lab.org/o/r.git tag/x a.wbt"},
        {ForgeAddress("https://h.lab.org", ForgeKind::github), "https://h.lab.org/o/r/raw/tag/x/worlds/a.wbt",
         "https://h.lab.org/o/r.git tag/x a.wbt"},
    };
    for (auto const& link : links)
        BOOST_TEST(read(link.url, link.forge) == link.expected,
                   link.url << ": " << read(link.url, link.forge));
}

BOOST_AUTO_TEST_CASE(a_page_that_another_kind_of_forge_has_is_none)
{
    BOOST_TEST(read("https://github.com/o/r/src/main/p/worlds/a.wbt", "https://github.com") ==
               "Missing blob in Webots simulation URL, founds src");
    BOOST_TEST(read("https://github.com/g/s/r/-/blob/main/worlds/a.wbt", "https://github.com") ==
               "Missing blob in Webots simulation URL, founds r");
    BOOST_TEST(read("https://gitlab.com/g/s/r/-/commits/main/worlds/a.wbt", "https://gitlab.com") ==
               "Missing blob in Webots simulation URL, founds r");
    BOOST_TEST(read("https://raw.githubusercontent.com/o/r/main/worlds/a.wbt", "https://gitlab.com")
                   .starts_with(
                       "Unsupported URL protocol: https://raw.githubusercontent.com/o/r/main/worlds/a.wbt."));
    BOOST_TEST(read("https://raw.githubusercontent.com.evil.org/o/r/main/worlds/a.wbt", "https://github.com")
                   .starts_with("Unsupported URL protocol: "));
}

BOOST_AUTO_TEST_CASE(names_in_every_form_of_link_are_checked)
{
    for (auto const* url : {
             "https://lab.org/g/../r/-/blob/main/worlds/a.wbt",
             "https://lab.org/g/.git/r/-/blob/main/worlds/a.wbt",
             "https://lab.org/g//r/-/blob/main/worlds/a.wbt",
             "https://lab.org/g/s/r.git/-/blob/main/worlds/a.wbt",
             "https://lab.org/g/s t/r/-/blob/main/worlds/a.wbt",
             "https://lab.org/o/r/src/branch//worlds/a.wbt",
             "https://lab.org/o/r/src/tag/.git/worlds/a.wbt",
             "https://lab.org/o/r/raw/main/%2e%2e/worlds/a.wbt",
         })
        BOOST_TEST(read(url, "https://lab.org").starts_with("Wrong Webots simulation URL: \""), url);
}

// They are copied more often than any other link that is no world's.
BOOST_AUTO_TEST_CASE(a_link_to_a_folder_is_answered_with_what_to_add)
{
    for (auto const* url :
         {"https://lab.org/o/r", "https://lab.org/o/r/", "https://lab.org/o/r/tree/main",
          "https://lab.org/o/r/tree/main/p", "https://lab.org/o/r/tree/main/p/worlds",
          "https://lab.org/o/r/tree/main/p/worlds/", "https://lab.org/g/s/r/-/tree/main/p/q/r",
          "https://lab.org/o/r/src/branch/main", "https://lab.org/o/r/src/main/worlds/?at=main"})
        BOOST_TEST(read(url, "https://lab.org") ==
                       "Wrong Webots simulation URL: it leads to a folder. Add the "
                       "name of a world file to it, as in worlds/my_world.wbt",
                   url);
}

BOOST_AUTO_TEST_CASE(a_world_outside_of_worlds_is_told_where_it_has_to_be)
{
    for (auto const* url :
         {"https://github.com/o/r/blob/main/a.wbt", "https://github.com/o/r/blob/main/world/a.wbt",
          "https://github.com/o/r/raw/main/p/q/a.wbt", "https://github.com/o/r/tree/main/Worlds/a.wbt"})
        BOOST_TEST(refusal_of(url) == sentence(core::Refused::address_not_in_worlds, {{"world", "a.wbt"}}),
                   url);
}

BOOST_AUTO_TEST_CASE(all_links_to_a_world_have_one_address)
{
    for (auto const* url : {"https://github.com/o/r/blob/main/p/worlds/a.wbt",
                            "https://github.com/o/r/tree/m%61in/p/worlds/a.wbt?x#y",
                            "https://github.com/o/r/raw/refs/heads/main/p/worlds/a.wbt",
                            "https://raw.githubusercontent.com/o/r/main/p/worlds/a.wbt"})
        BOOST_TEST(parse_world_url(url, forges).value().address() ==
                       "https://github.com/o/r/blob/main/p/worlds/a.wbt",
                   url);
    BOOST_TEST(parse_world_url("https://lab.org/g/s/r/-/blob/v1/worlds/a.wbt", {"https://lab.org"})
                   .value()
                   .address() == "https://lab.org/g/s/r/blob/v1/worlds/a.wbt");
}

BOOST_AUTO_TEST_CASE(endless_urls_are_refused)
{
    auto const url = "https://github.com/o/r/blob/main/" + std::string(5000, 'a') + "/worlds/a.wbt";
    BOOST_TEST(refusal_of(url) == "Wrong Webots simulation URL: longer than 2048 characters");
}

BOOST_AUTO_TEST_CASE(a_repository_and_its_folders_are_named_by_the_pages_of_all_forges)
{
    std::vector<ForgeAddress> const known{"https://github.com",      "https://gitlab.com",
                                          "https://codeberg.org",    "https://bitbucket.org",
                                          "https://git.example.org", "local:"};
    struct Row
    {
        char const* url;
        char const* names;
        char const* ref_and_folder;
    };
    for (auto const& [url, names, ref_and_folder] :
         std::vector<Row>{{"https://github.com/o/r", "o/r", "HEAD"},
                          {"https://github.com/o/r/", "o/r", "HEAD"},
                          {"https://github.com/o/r.git", "o/r", "HEAD"},
                          {"https://github.com/o/r?tab=readme-ov-file#robots", "o/r", "HEAD"},
                          {"https://github.com/o/r/tree/main", "o/r", "main"},
                          {"https://github.com/o/r/tree/main/", "o/r", "main"},
                          {"https://github.com/o/r/tree/feature/x/my%20worlds", "o/r", "feature/x/my worlds"},
                          {"https://github.com/o/r/blob/main/a/README.md", "o/r", "main/a"},
                          {"https://github.com/o/r/blob/main/README.md", "o/r", "main"},
                          {"https://gitlab.com/group/sub/r", "group/sub/r", "HEAD"},
                          {"https://gitlab.com/group/sub/r/-/tree/main/worlds?ref_type=heads", "group/sub/r",
                           "main/worlds"},
                          {"https://codeberg.org/o/r/src/branch/main/worlds", "o/r", "main/worlds"},
                          {"https://codeberg.org/o/r/src/tag/v1", "o/r", "refs/tags/v1"},
                          {"https://bitbucket.org/o/r/src/main/worlds/", "o/r", "main/worlds"},
                          {"https://git.example.org/group/sub/r", "group/sub/r", "HEAD"},
                          {"https://git.example.org/o/r/src/branch/main/a", "o/r", "main/a"},
                          {"local:/school/week_1", "school/week_1", "HEAD"}}) {
        auto const project = parse_folder_url(url, known);
        BOOST_TEST_REQUIRE(project.has_value(), url);
        BOOST_TEST(project->owner + "/" + project->repository == names, url);
        BOOST_TEST(project->ref_and_folder == ref_and_folder, url);
        BOOST_TEST(project->world.empty(), url);
    }
    for (auto const* other : {"https://github.com/o", "https://github.com/o/r/issues", "https://github.com/",
                              "https://evil.example/o/r", "https://github.com/o/../tree/main",
                              "https://github.com/o/r/tree/main/a%5Cb", "https://github.com/o/r/tree/%zz"})
        BOOST_TEST(parse_folder_url(other, known).has_error(), other);
    BOOST_TEST(
        parse_folder_url("https://github.com/o/r/issues", known).error().message() ==
        "This address leads to no repository, and to no folder of one. Copy it from the page that lists the "
        "files.");
}

BOOST_AUTO_TEST_SUITE_END()
