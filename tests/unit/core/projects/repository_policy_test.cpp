#include "refusal_sentences.hpp"
#include "unit_test.hpp"

#include "core/projects/repository_policy.hpp"

using namespace webots_cloud::core;
using webots_cloud::RefMeaning;

// Protocol section 4.1.2, step 3, and quirk Q17.
BOOST_AUTO_TEST_SUITE(repository_policy)

namespace {

ForgeOfWorld const github("https://github.com", RefMeaning::git);
ForgeOfWorld const folder("local:", RefMeaning::none);

RepositoryPolicy sharing()
{
    RepositoryPolicy policy;
    policy.rules.allowed = {"https://github.com/cyberbotics", "https://github.com/o/r/blob/main/projects"};
    policy.rules.blocked = {"https://github.com/evil"};
    policy.rules.share_idle_time = 50;
    policy.outside.accepted = true;
    return policy;
}

} // namespace

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
    for (auto const covers : {allows, blocks}) {
        BOOST_TEST(
            covers("https://github.com/Cyberbotics/", "https://github.com/cyberBOTICS/webots", github));
        BOOST_TEST(covers("https://github.com/evil", "https://github.com/%45vil/x", github));
        BOOST_TEST(!covers("https://github.com/o/r/blob/Main",
                           "https://github.com/o/r/blob/main/worlds/a.wbt", github));
    }
}

BOOST_AUTO_TEST_CASE(blob_and_tree_are_the_same)
{
    for (auto const covers : {allows, blocks}) {
        BOOST_TEST(covers("https://github.com/o/r/tree/main", "https://github.com/o/r/blob/main/worlds/a.wbt",
                          github));
        BOOST_TEST(covers("local:/demo/robots/tree", "local:/demo/robots/blob/main/worlds/a.wbt", folder));
    }
}

// Later it is refused as malformed, with a sentence that says so.
BOOST_AUTO_TEST_CASE(a_malformed_rest_is_no_reason_to_take_it_for_another_repository)
{
    for (auto const covers : {allows, blocks}) {
        BOOST_TEST(covers("https://github.com/o", "https://github.com/o/r/blob/main/worlds/50%.wbt", github));
        BOOST_TEST(
            !covers("https://github.com/o", "https://github.com/%zz/r/blob/main/worlds/a.wbt", github));
    }
}

// Quirk Q25.
BOOST_AUTO_TEST_CASE(a_query_or_fragment_changes_nothing)
{
    for (auto const covers : {allows, blocks}) {
        for (std::string const rest : {"?raw=1", "#L3", "?x/y", "?%zz"})
            BOOST_TEST(covers("https://github.com/o/r/blob/main/worlds/a.wbt",
                              "https://github.com/o/r/blob/main/worlds/a.wbt" + rest, github),
                       rest);
        BOOST_TEST(!covers("https://github.com/o/r/blob/main/worlds/a.wbt",
                           "https://github.com/o?/r/blob/main/worlds/a.wbt", github));
    }
}

BOOST_AUTO_TEST_CASE(on_a_forge_with_a_path_owners_and_kinds_are_found_too)
{
    ForgeOfWorld const forge("http://localhost:8080/git", RefMeaning::git);
    constexpr std::string_view url = "http://localhost:8080/git/o/Blob/blob/Main/worlds/a.wbt";
    for (auto const covers : {allows, blocks}) {
        BOOST_TEST(covers("http://localhost:8080/git/o/Blob", url, forge));
        BOOST_TEST(covers("http://localhost:8080/git/o/Blob/tree/Main", url, forge));
        BOOST_TEST(covers("http://localhost:8080/git", url, forge));
        BOOST_TEST(covers("http://localhost:8080", url, forge));
        BOOST_TEST(!covers("http://localhost:8080/git/o/tree", url, forge));
        BOOST_TEST(!covers("http://localhost:8080/git/o/Blob/blob/main", url, forge));
        BOOST_TEST(!covers("http://localhost:8080/gi", url, forge));
    }
}

BOOST_AUTO_TEST_CASE(an_empty_prefix_covers_nothing_and_a_scheme_everything)
{
    for (auto const covers : {allows, blocks}) {
        BOOST_TEST(!covers("", "https://github.com/o/r", github));
        BOOST_TEST(!covers("/", "https://github.com/o/r", github));
        BOOST_TEST(covers("https://", "https://github.com/o/r", github));
        BOOST_TEST(covers("https:", "https://github.com/o/r", github));
        BOOST_TEST(!covers("http://", "https://github.com/o/r", github));
    }
}

constexpr std::string_view hash = "0123456789abcdef0123456789abcdef01234567";

std::string world(std::string const& ref, std::string const& repository = "o/r")
{
    return "https://github.com/" + repository + "/blob/" + ref + "/worlds/a.wbt";
}

// Seen: `refs/heads/main` and a hash ran what `main` was blocked for.
BOOST_AUTO_TEST_CASE(a_blocked_branch_is_blocked_under_all_its_names)
{
    constexpr std::string_view rule = "https://github.com/o/r/blob/main";
    for (auto const& ref :
         {std::string("main"), std::string("main/projects/p"), std::string("refs/heads/main"),
          std::string("refs%2Fheads%2Fmain"), std::string("refs/tags/main"),
          std::string("refs/heads/main/projects/p"), std::string("m%61in"), std::string("HEAD"),
          std::string("HEAD/projects/p"), std::string(hash), std::string(hash) + "/projects/p",
          std::string("0123456789ABCDEF0123456789ABCDEF01234567")}) {
        BOOST_TEST(blocks(rule, world(ref), github), ref);
        BOOST_TEST(blocks("https://github.com/o/r/tree/refs/heads/main", world(ref), github), ref);
        BOOST_TEST(blocks("https://github.com/O/R.git/commits/main", world(ref), github), ref);
        BOOST_TEST(blocks("https://github.com/o/r/-/tree/main", world(ref), github), ref);
        BOOST_TEST(blocks("https://github.com/o/r", world(ref), github), ref);
    }
    for (auto const* ref :
         {"mainly", "refs/heads/mainly", "refs/main", "refs/heads", "other/main", "main2/main"})
        BOOST_TEST(!blocks(rule, world(ref), github), ref);
    BOOST_TEST(!blocks(rule, world(std::string(hash), "o/other"), github));
    BOOST_TEST(!blocks(rule, world("HEAD", "other/r"), github));
}

BOOST_AUTO_TEST_CASE(a_blocked_folder_of_a_branch_blocks_commits_whatever_the_folder)
{
    constexpr std::string_view rule = "https://github.com/o/r/blob/main/projects/p"; // or is that the branch?
    BOOST_TEST(blocks(rule, world("refs/heads/main/projects/p"), github));
    BOOST_TEST(blocks(rule, world(std::string(hash)), github));
    BOOST_TEST(!blocks(rule, world("main/projects/q"), github));
}

BOOST_AUTO_TEST_CASE(a_blocked_commit_blocks_branches_which_may_lead_to_it_but_no_other_commit)
{
    auto const rule = "https://github.com/o/r/commit/" + std::string(hash);
    BOOST_TEST(blocks(rule, world("0123456789ABCDEF0123456789ABCDEF01234567"), github));
    BOOST_TEST(blocks(rule, world("main"), github));
    BOOST_TEST(!blocks(rule, world("1123456789abcdef0123456789abcdef01234567"), github));
    BOOST_TEST(!blocks(rule, world("main", "o/other"), github));
}

// Seen: `x.GIT` ran what `x` was blocked for.
BOOST_AUTO_TEST_CASE(a_blocked_repository_is_blocked_however_rule_and_address_are_spelt)
{
    for (auto const* rule : {"https://github.com/evil/x",
                             "https://github.com/Evil/X/",
                             "https://github.com/evil/x.git",
                             "https://github.com/evil/x.GIT",
                             "https://github.com/evil/x.gIt/",
                             "https://GitHub.com/evil/x",
                             "https://github.com:443/evil/x",
                             "https://github.com./evil/x",
                             "https://www.github.com/evil/x",
                             "http://github.com/evil/x",
                             "github.com/evil/x",
                             "https://me@github.com/evil/x",
                             "https://github.com//evil///x",
                             "https://github.com/./evil/../evil/x",
                             "https://github.com/%65vil/x",
                             "https://github.com/evil%2Fx",
                             " https://github.com/evil/x ",
                             "https://github.com/evil/x?tab=readme",
                             "https://github.com/evil/x#readme",
                             "https://github.com/evil"})
        for (auto const* repository : {"evil/x", "EVIL/x", "evil/X", "evil/x.git", "evil/x.GIT", "evil/x.gIt",
                                       "/evil//x", "%65vil/x", "evil%2Fx", "./evil/y/../x"})
            BOOST_TEST(blocks(rule, world("main", repository), github), rule << " " << repository);
    for (auto const* other : {"evil/xx", "evil/x.gi", "evil/git", "evi/lx", "x/evil", "evil-2/x"})
        BOOST_TEST(!blocks("https://github.com/evil/x", world("main", other), github), other);
    BOOST_TEST(!blocks("https://github.org/evil/x", world("main", "evil/x"), github));
    BOOST_TEST(!blocks("https://github.com:8443/evil/x", world("main", "evil/x"), github));
    BOOST_TEST(!blocks("https://github.com@evil.org/evil/x", world("main", "evil/x"), github));
}

BOOST_AUTO_TEST_CASE(what_is_allowed_is_named_for_certain)
{
    constexpr std::string_view rule = "https://github.com/o/r/blob/main";
    BOOST_TEST(allows(rule, world("main/p"), github));
    BOOST_TEST(allows("https://github.com/O/R.git/tree/main", world("main/p"), github));
    BOOST_TEST(allows("https://GitHub.com:443//o/r/", world("other"), github));
    for (auto const& ref :
         {std::string("refs/heads/main"), std::string("refs/tags/main"), std::string("HEAD"),
          std::string(hash), std::string("Main"), std::string("mainly")})
        BOOST_TEST(!allows(rule, world(ref), github), ref);
    for (auto const* vague : {"http://github.com/o/r", "https://www.github.com/o/r", "github.com/o/r",
                              "https://github.com/o/r/commits/main", "https://github.com/o/r/-/tree/main",
                              "https://github.com/o/r/blob/refs/heads/main", "https://github.com/o/r/blo"})
        BOOST_TEST(!allows(vague, world("main"), github), vague);
    BOOST_TEST(!allows("https://github.com/o/r/blob/" + std::string(hash), world("main"), github));
}

BOOST_AUTO_TEST_CASE(a_forge_of_ones_own_may_tell_upper_from_lower_case)
{
    ForgeOfWorld const forge("http://localhost:8080", RefMeaning::git);
    constexpr std::string_view url = "http://localhost:8080/Good/robots/blob/main/worlds/a.wbt";
    BOOST_TEST(allows("http://localhost:8080/Good", url, forge));
    BOOST_TEST(!allows("http://localhost:8080/good", url, forge));
    BOOST_TEST(!allows("http://localhost:8080/Good/Robots", url, forge));
    BOOST_TEST(blocks("http://localhost:8080/good", url, forge));
    BOOST_TEST(blocks("http://localhost:8080/Good/Robots", url, forge));
}

BOOST_AUTO_TEST_CASE(a_plain_folder_has_no_branches_that_a_rule_could_tell_apart)
{
    constexpr std::string_view rule = "local:/o/r/blob/main/p";
    BOOST_TEST(blocks(rule, "local:/o/r/blob/main/p/worlds/a.wbt", folder));
    BOOST_TEST(blocks(rule, "local:/o/r/blob/whatever/p/worlds/a.wbt", folder));
    BOOST_TEST(!blocks(rule, "local:/o/r/blob/main/q/worlds/a.wbt", folder));
    BOOST_TEST(!allows(rule, "local:/o/r/blob/whatever/p/worlds/a.wbt", folder));
}

// Seen: `https:` was taken for git's, and another branch ran what a rule with a branch had blocked.
BOOST_AUTO_TEST_CASE(a_plain_folder_is_known_by_its_source_and_not_by_its_address)
{
    ForgeOfWorld const forge("https://projects.lab.org", RefMeaning::none);
    constexpr std::string_view rule = "https://projects.lab.org/o/r/blob/main/p";
    BOOST_TEST(blocks(rule, "https://projects.lab.org/o/r/blob/main/p/worlds/a.wbt", forge));
    BOOST_TEST(blocks(rule, "https://projects.lab.org/o/r/blob/whatever/p/worlds/a.wbt", forge));
    BOOST_TEST(blocks("https://projects.lab.org/o/r/tree/main",
                      "https://projects.lab.org/o/r/blob/whatever/p/worlds/a.wbt", forge));
    BOOST_TEST(!blocks(rule, "https://projects.lab.org/o/r/blob/HEAD/q/worlds/a.wbt", forge));

    ForgeOfWorld const git("file:///srv/git", RefMeaning::git);
    BOOST_TEST(blocks("file:///srv/git/o/r/blob/main", "file:///srv/git/o/r/blob/HEAD/worlds/a.wbt", git));
    BOOST_TEST(!blocks("file:///srv/git/o/r/blob/main", "file:///srv/git/o/r/blob/x/worlds/a.wbt", git));
}

BOOST_AUTO_TEST_CASE(where_it_is_unknown_what_refs_mean_a_rule_with_one_blocks_them_all)
{
    ForgeOfWorld const forge("https://hg.lab.org", RefMeaning::unknown);
    BOOST_TEST(
        blocks("https://hg.lab.org/o/r/blob/main", "https://hg.lab.org/o/r/blob/tip/worlds/a.wbt", forge));
    BOOST_TEST(
        !blocks("https://hg.lab.org/o/r/blob/main", "https://hg.lab.org/o/x/blob/main/worlds/a.wbt", forge));
    BOOST_TEST(
        !allows("https://hg.lab.org/o/r/blob/main", "https://hg.lab.org/o/r/blob/tip/worlds/a.wbt", forge));
}

BOOST_AUTO_TEST_CASE(what_is_allowed_is_never_blocked)
{
    auto policy = sharing();
    policy.rules.blocked = policy.rules.allowed;
    BOOST_TEST(!refusal(policy, "https://github.com/cyberbotics/webots/blob/main/worlds/a.wbt", github, 0));
}

BOOST_AUTO_TEST_CASE(others_are_refused_in_the_words_that_browsers_know)
{
    auto policy = sharing();
    BOOST_TEST(!refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 50));
    BOOST_TEST(refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 50.5)->message() ==
               "Cannot share idle time when current load is above threshold: 50.5.");
    BOOST_TEST(
        refusal(policy, "https://github.com/evil/x/blob/main/worlds/a.wbt", github, 0)->message() ==
        "Cannot run simulation from blocked repository: https://github.com/evil/x/blob/main/worlds/a.wbt");
    BOOST_TEST(refusal(policy, "https://github.com/evil/x/blob/main/worlds/a.wbt", github, 60)
                   ->message()
                   .starts_with("Cannot share idle time"));
    policy.rules.share_idle_time = 0;
    BOOST_TEST(refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 0)->message() ==
               "This simulation server is not configured to share idle time.");
    policy.outside.accepted = false;
    BOOST_TEST(refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 0)->message() ==
               webots_cloud::sentence(Refused::outside_allowed));
    policy.outside.needed = "a sandbox that it names";
    BOOST_TEST(refusal(policy, "https://github.com/o/x/blob/main/worlds/a.wbt", github, 0)->message() ==
               webots_cloud::sentence(Refused::outside_sandbox, {{"needed", "a sandbox that it names"}}));
}

// Rules are copied from the pages of forges, as links to worlds are.
BOOST_AUTO_TEST_CASE(rules_and_links_of_every_forge_name_the_same)
{
    ForgeOfWorld const gitlab("https://gitlab.com", RefMeaning::git);
    ForgeOfWorld const own("https://git.lab.org", RefMeaning::git);
    struct Case
    {
        ForgeOfWorld forge;
        std::string_view world;
        std::vector<std::string_view> named_by;
        std::vector<std::string_view> not_allowed_by;
    };
    std::vector<Case> const cases{
        {github,
         "https://raw.githubusercontent.com/o/r/main/p/worlds/a.wbt",
         {"https://github.com/o", "https://github.com/o/r/blob/main",
          "https://raw.githubusercontent.com/o/r/main", "https://github.com/o/r/raw/main/p"},
         {"https://github.com/o/r/blob/x", "https://github.com/x",
          "https://raw.githubusercontent.com/o/r/x"}},
        {gitlab,
         "https://gitlab.com/g/s/r/-/blob/main/p/worlds/a.wbt",
         {"https://gitlab.com/g", "https://gitlab.com/G/s", "https://gitlab.com/g/s/r",
          "https://gitlab.com/g/s/r.git", "https://gitlab.com/g/s/r/-/tree/main",
          "https://gitlab.com/g/s/r/blob/main/p"},
         {"https://gitlab.com/g/s/x", "https://gitlab.com/g/s/r/-/tree/x",
          "https://gitlab.com/g/s/r/-/tree/main/q", "https://gitlab.com/s", "https://gitlab.com/g/s2"}},
        {own,
         "https://git.lab.org/o/r/src/branch/main/p/worlds/a.wbt",
         {"https://git.lab.org/o", "https://git.lab.org/o/r/src/branch/main",
          "https://git.lab.org/o/r/src/main", "https://git.lab.org/o/r/blob/main/p",
          "https://git.lab.org/o/r/raw/branch/main"},
         {"https://git.lab.org/o/r/src/tag/main", "https://git.lab.org/o/r/src/branch/x"}},
        {own,
         "https://git.lab.org/o/r/src/tag/v1/worlds/a.wbt",
         {"https://git.lab.org/o/r", "https://git.lab.org/o/r/src/tag/v1",
          "https://git.lab.org/o/r/blob/refs/tags/v1"},
         {"https://git.lab.org/o/r/src/branch/v1", "https://git.lab.org/o/r/blob/v1"}},
    };
    for (auto const& each : cases) {
        for (auto const rule : each.named_by) {
            BOOST_TEST(allows(rule, each.world, each.forge), rule << " " << each.world);
            BOOST_TEST(blocks(rule, each.world, each.forge), rule << " " << each.world);
            BOOST_TEST(is_on_forge(rule, each.forge.url), rule);
        }
        for (auto const rule : each.not_allowed_by)
            BOOST_TEST(!allows(rule, each.world, each.forge), rule << " " << each.world);
    }
}

BOOST_AUTO_TEST_CASE(a_blocked_branch_is_blocked_in_every_form_of_link)
{
    ForgeOfWorld const forge("https://git.lab.org", RefMeaning::git);
    for (std::string const rule : {"blob/main", "src/branch/main", "src/main", "raw/branch/main",
                                   "-/tree/main", "commits/branch/main", "src/tag/main", "branch/main"})
        for (std::string const world :
             {"blob/main", "src/branch/main", "src/tag/main", "src/main", "raw/branch/main", "-/raw/main",
              "media/branch/main/p", "src/branch/HEAD"}) {
            auto const url = "https://git.lab.org/g/r/" + world + "/worlds/a.wbt";
            BOOST_TEST(blocks("https://git.lab.org/g/r/" + rule, url, forge), rule << " " << world);
            BOOST_TEST(!blocks("https://git.lab.org/g/x/" + rule, url, forge), rule << " " << world);
            BOOST_TEST(!blocks("https://git.lab.org/g/r/" + rule + "ly",
                               "https://git.lab.org/g/r/src/branch/main/worlds/a.wbt", forge),
                       rule);
        }
}

BOOST_AUTO_TEST_SUITE_END()
