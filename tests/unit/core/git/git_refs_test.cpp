// Which commit and which folder an address means.
#include "unit_test.hpp"

#include "core/git/git_refs.hpp"

using namespace webots_cloud;
using core::GitRef;
using core::resolve_ref;

// Protocol section 4.1.2, steps 5 to 7, and section 13: refs with slashes, and hashes.
BOOST_AUTO_TEST_SUITE(git_refs)

namespace {

core::GitObjectId id(char digit)
{
    return *core::git_object_id(std::string(40, digit));
}

GitRef ref(std::string name, char digit)
{
    GitRef made;
    made.name = std::move(name);
    made.id = id(digit);
    return made;
}

/// `<first digit of the commit>:<folder>`, or which ref there is not.
std::string resolved(std::string_view path, std::vector<GitRef> const& refs)
{
    auto const target = resolve_ref(path, refs);
    return target ? to_hex(target->commit).substr(0, 1) + ":" + target->folder
                  : "none: " + target.error().detail();
}

} // namespace

BOOST_AUTO_TEST_CASE(what_follows_the_branch_is_the_folder)
{
    std::vector const refs{ref("refs/heads/main", 'a')};
    BOOST_TEST(resolved("main", refs) == "a:");
    BOOST_TEST(resolved("main/projects/robot", refs) == "a:projects/robot");
}

BOOST_AUTO_TEST_CASE(the_longest_ref_wins)
{
    std::vector const refs{ref("refs/heads/feature", 'a'), ref("refs/tags/feature/arm/v2", 'c'),
                           ref("refs/heads/feature/arm", 'b')};
    BOOST_TEST(resolved("feature/arm/projects", refs) == "b:projects");
    BOOST_TEST(resolved("feature/arm/v2/projects", refs) == "c:projects");
    BOOST_TEST(resolved("feature/leg", refs) == "a:leg");
}

BOOST_AUTO_TEST_CASE(a_ref_matches_whole_segments_only)
{
    std::vector const refs{ref("refs/heads/main", 'a')};
    BOOST_TEST(resolved("main2/projects", refs) == "none: main2");
    BOOST_TEST(resolved("mai", refs) == "none: mai");
}

BOOST_AUTO_TEST_CASE(what_is_no_ref_is_named_without_the_folder_after_it)
{
    std::vector const refs{ref("refs/heads/main", 'a'), ref("refs/heads/team/red", 'b'),
                           ref("refs/tags/team/v1/final", 'c')};
    auto const named = [&](std::string_view path) { return resolved(path, refs); };
    BOOST_TEST(named("mian/projects/robots") == "none: mian");
    BOOST_TEST(named("team/green/projects/robots") == "none: team/green");
    BOOST_TEST(named("team/v1/draft/projects") == "none: team/v1/draft");
    BOOST_TEST(named("team/v1") == "none: team/v1");
    BOOST_TEST(named("team") == "none: team");
    BOOST_TEST(named("refs/heads/mian/projects") == "none: refs/heads/mian");
    BOOST_TEST(resolved("mian/projects", {}) == "none: mian");
}

BOOST_AUTO_TEST_CASE(a_branch_goes_before_a_tag_of_the_same_name_in_either_order)
{
    BOOST_TEST(resolved("v1/x", {ref("refs/heads/v1", 'a'), ref("refs/tags/v1", 'b')}) == "a:x");
    BOOST_TEST(resolved("v1/x", {ref("refs/tags/v1", 'b'), ref("refs/heads/v1", 'a')}) == "a:x");
}

BOOST_AUTO_TEST_CASE(forty_hexadecimal_digits_are_a_commit)
{
    std::string const commit(40, 'd');
    BOOST_TEST(core::names_commit(commit + "/projects"));
    BOOST_TEST(resolved(commit + "/projects", {}) == "d:projects");
    BOOST_TEST(!core::names_commit(commit.substr(1)));
    BOOST_TEST(!core::names_commit(commit + "d"));
    BOOST_TEST(!core::names_commit("g" + commit.substr(1)));
}

BOOST_AUTO_TEST_CASE(the_full_name_tells_a_branch_from_a_tag_of_the_same_name)
{
    std::vector<GitRef> const refs{ref("refs/heads/v1", 'a'), ref("refs/tags/v1", 'b'),
                                   ref("refs/heads/v1/x", 'c')};
    BOOST_TEST(resolved("refs/tags/v1/x", refs) == "b:x");
    BOOST_TEST(resolved("refs/heads/v1/x/y", refs) == "c:y");
    auto const prefixes = core::ref_prefixes("refs/tags/v1/x");
    BOOST_TEST(std::count(prefixes.begin(), prefixes.end(), "refs/tags/v1") == 1);
}

BOOST_AUTO_TEST_CASE(other_kinds_of_refs_cannot_be_named)
{
    std::vector const refs{ref("refs/pull/1/head", 'a'), ref("refs/remotes/main", 'b')};
    BOOST_TEST(resolved("refs/pull/1/head", refs) == "none: refs/pull/1/head");
    BOOST_TEST(resolved("main", refs) == "none: main");
}

BOOST_AUTO_TEST_CASE(branches_and_tags_are_told_from_refs_that_strangers_may_write)
{
    for (auto const* const name : {"refs/heads/main", "refs/tags/v1"})
        BOOST_TEST(core::is_branch_or_tag(name), name);
    for (auto const* const name : {"refs/pull/1/head", "refs/remotes/main", "refs/headsx", "HEAD", ""})
        BOOST_TEST(!core::is_branch_or_tag(name), name);
    for (auto const& prefix : core::all_ref_prefixes())
        BOOST_TEST(core::is_branch_or_tag(prefix), prefix);
}

BOOST_AUTO_TEST_CASE(the_head_of_the_repository_can_be_named)
{
    BOOST_TEST(resolved("HEAD/projects", {ref("HEAD", 'e')}) == "e:projects");
    BOOST_TEST(core::ref_prefixes("HEAD/x").front() == "HEAD");
}

BOOST_AUTO_TEST_CASE(only_refs_that_begin_with_the_first_segment_are_asked_for)
{
    auto const prefixes = core::ref_prefixes("feature/arm/projects");
    BOOST_TEST(prefixes == (std::vector<std::string>{"refs/heads/feature", "refs/tags/feature"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(an_annotated_tag_means_the_commit_that_it_points_to)
{
    auto const line = std::string(40, 'a') + " refs/tags/v1 peeled:" + std::string(40, 'b');
    auto const parsed = core::parse_ref_line(line);
    BOOST_REQUIRE(parsed.has_value());
    BOOST_TEST(parsed->name == "refs/tags/v1");
    BOOST_TEST((parsed->id == id('b')));
}

BOOST_AUTO_TEST_CASE(the_default_branch_is_the_one_that_the_head_stands_for)
{
    auto const head = [](std::string const& rest) {
        return core::default_branch({core::parse_ref_line(std::string(40, '1') + " HEAD" + rest).value()});
    };
    BOOST_TEST(head(" symref-target:refs/heads/team/main") == "team/main");
    for (auto const* unknown :
         {"", " symref-target:", " symref-target:refs/heads/", " symref-target:refs/tags/v1"})
        BOOST_TEST(head(unknown) == "HEAD", unknown);
    BOOST_TEST(core::default_branch({}) == "HEAD");
}

BOOST_AUTO_TEST_CASE(lines_that_are_no_refs_are_errors)
{
    for (auto const& line :
         {std::string(), std::string(" "), std::string(40, 'a'), std::string(40, 'a') + " ",
          std::string(39, 'a') + " refs/heads/main", "unborn HEAD " + std::string(40, 'a'),
          std::string(64, 'a') + " refs/heads/main"})
        BOOST_TEST(core::parse_ref_line(line).has_error(), line);
}

BOOST_AUTO_TEST_SUITE_END()
