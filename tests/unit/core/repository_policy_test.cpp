#include "unit_test.hpp"

#include "core/repository_policy.hpp"

using namespace webots_cloud::core;

namespace {

constexpr std::string_view github = "https://github.com";

RepositoryPolicy sharing()
{
    RepositoryPolicy policy;
    policy.allowed = {"https://github.com/cyberbotics", "https://github.com/o/r/blob/main/projects"};
    policy.blocked = {"https://github.com/evil"};
    policy.share_idle_time = 50;
    policy.docker = true;
    return policy;
}

} // namespace

// Protocol section 4.1.2, step 4, and quirk Q17.
BOOST_AUTO_TEST_SUITE(repository_policy)

BOOST_AUTO_TEST_CASE(an_allowed_prefix_covers_whole_segments_only)
{
    auto const policy = sharing();
    BOOST_TEST(!refusal(policy, "https://github.com/cyberbotics/webots/blob/main/worlds/a.wbt", github, 100));
    BOOST_TEST(!refusal(policy, "https://github.com/o/r/blob/main/projects/p/worlds/a.wbt", github, 100));
    BOOST_TEST(
        refusal(policy, "https://github.com/cyberbotics-evil/webots/blob/main/worlds/a.wbt", github, 100)
            .has_value());
    BOOST_TEST(
        refusal(policy, "https://github.com/o/r/blob/main/projects2/worlds/a.wbt", github, 100).has_value());
}

BOOST_AUTO_TEST_CASE(owners_compare_without_case_as_forges_do)
{
    BOOST_TEST(covers("https://github.com/Cyberbotics/", "https://github.com/cyberBOTICS/webots", github));
    BOOST_TEST(covers("https://github.com/evil", "https://github.com/%45vil/x", github));
    BOOST_TEST(
        !covers("https://github.com/o/r/blob/Main", "https://github.com/o/r/blob/main/worlds/a.wbt", github));
}

BOOST_AUTO_TEST_CASE(blob_and_tree_are_the_same)
{
    BOOST_TEST(
        covers("https://github.com/o/r/tree/main", "https://github.com/o/r/blob/main/worlds/a.wbt", github));
    BOOST_TEST(covers("local:/demo/robots/tree", "local:/demo/robots/blob/main/worlds/a.wbt", "local:"));
}

// It is refused as malformed later on, with a sentence that says so.
BOOST_AUTO_TEST_CASE(a_malformed_rest_is_no_reason_to_take_it_for_another_repository)
{
    BOOST_TEST(covers("https://github.com/o", "https://github.com/o/r/blob/main/worlds/50%.wbt", github));
    BOOST_TEST(!covers("https://github.com/o", "https://github.com/%zz/r/blob/main/worlds/a.wbt", github));
}

// Quirk Q25.
BOOST_AUTO_TEST_CASE(a_query_or_fragment_changes_nothing)
{
    for (std::string const rest : {"?raw=1", "#L3", "?x/y", "?%zz"})
        BOOST_TEST(covers("https://github.com/o/r/blob/main/worlds/a.wbt",
                          "https://github.com/o/r/blob/main/worlds/a.wbt" + rest, github),
                   rest);
    BOOST_TEST(!covers("https://github.com/o/r/blob/main/worlds/a.wbt",
                       "https://github.com/o?/r/blob/main/worlds/a.wbt", github));
}

BOOST_AUTO_TEST_CASE(on_a_forge_with_a_path_owners_and_kinds_are_found_too)
{
    constexpr std::string_view forge = "http://localhost:8080/git";
    constexpr std::string_view url = "http://localhost:8080/git/o/Blob/blob/Main/worlds/a.wbt";
    BOOST_TEST(covers("http://localhost:8080/git/O/blob", url, forge));
    BOOST_TEST(covers("http://localhost:8080/git/o/blob/tree/Main", url, forge));
    BOOST_TEST(!covers("http://localhost:8080/git/o/tree", url, forge));
    BOOST_TEST(!covers("http://localhost:8080/git/o/blob/blob/main", url, forge));
}

BOOST_AUTO_TEST_CASE(an_empty_prefix_covers_nothing)
{
    BOOST_TEST(!covers("", "https://github.com/o/r", github));
}

BOOST_AUTO_TEST_CASE(what_is_allowed_is_never_blocked)
{
    auto policy = sharing();
    policy.blocked = policy.allowed;
    BOOST_TEST(!refusal(policy, "https://github.com/cyberbotics/webots/blob/main/worlds/a.wbt", github, 0));
}

BOOST_AUTO_TEST_CASE(others_are_refused_in_the_words_that_browsers_know)
{
    auto policy = sharing();
    BOOST_TEST(!refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 50));
    BOOST_TEST(*refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 50.5) ==
               "Cannot share idle time when current load is above threshold: 50.5.");
    BOOST_TEST(
        *refusal(policy, "https://github.com/evil/x/blob/main/worlds/a.wbt", github, 0) ==
        "Cannot run simulation from blocked repository: https://github.com/evil/x/blob/main/worlds/a.wbt");
    BOOST_TEST(refusal(policy, "https://github.com/evil/x/blob/main/worlds/a.wbt", github, 60)
                   ->starts_with("Cannot share idle time"));
    policy.share_idle_time = 0;
    BOOST_TEST(*refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 0) ==
               "This simulation server is not configured to share idle time.");
    policy.docker = false;
    BOOST_TEST(
        *refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 0) ==
        "Docker not enabled: cannot host simulations from repositories outside of \"allowedRepositories\".");
}

BOOST_AUTO_TEST_SUITE_END()
