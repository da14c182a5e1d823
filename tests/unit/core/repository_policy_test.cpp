#include "unit_test.hpp"

#include "core/repository_policy.hpp"

using namespace webots_cloud::core;

namespace {

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
    BOOST_TEST(!refusal(policy, "https://github.com/cyberbotics/webots/blob/main/worlds/a.wbt", 100));
    BOOST_TEST(!refusal(policy, "https://github.com/o/r/blob/main/projects/p/worlds/a.wbt", 100));
    BOOST_TEST(refusal(policy, "https://github.com/cyberbotics-evil/webots/blob/main/worlds/a.wbt", 100).has_value());
    BOOST_TEST(refusal(policy, "https://github.com/o/r/blob/main/projects2/worlds/a.wbt", 100).has_value());
}

BOOST_AUTO_TEST_CASE(owners_compare_without_case_as_forges_do)
{
    BOOST_TEST(covers("https://github.com/Cyberbotics/", "https://github.com/cyberBOTICS/webots"));
    BOOST_TEST(covers("https://github.com/evil", "https://github.com/%45vil/x"));
    BOOST_TEST(!covers("https://github.com/o/r/blob/Main", "https://github.com/o/r/blob/main/worlds/a.wbt"));
}

BOOST_AUTO_TEST_CASE(blob_and_tree_are_the_same)
{
    BOOST_TEST(covers("https://github.com/o/r/tree/main", "https://github.com/o/r/blob/main/worlds/a.wbt"));
    BOOST_TEST(covers("local:/demo/robots/tree", "local:/demo/robots/blob/main/worlds/a.wbt"));
}

BOOST_AUTO_TEST_CASE(an_empty_prefix_covers_nothing) { BOOST_TEST(!covers("", "https://github.com/o/r")); }

BOOST_AUTO_TEST_CASE(others_are_refused_in_the_words_that_browsers_know)
{
    auto policy = sharing();
    BOOST_TEST(!refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", 50));
    BOOST_TEST(*refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", 50.5) ==
               "Cannot share idle time when current load is above threshold: 50.5.");
    BOOST_TEST(*refusal(policy, "https://github.com/evil/x/blob/main/worlds/a.wbt", 0) ==
               "Cannot run simulation from blocked repository: https://github.com/evil/x/blob/main/worlds/a.wbt");
    policy.share_idle_time = 0;
    BOOST_TEST(*refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", 0) ==
               "This simulation server is not configured to share idle time.");
    policy.docker = false;
    BOOST_TEST(*refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", 0) ==
               "Docker not enabled: cannot host simulations from repositories outside of \"allowedRepositories\".");
}

BOOST_AUTO_TEST_SUITE_END()
