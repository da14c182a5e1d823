// Which commits belong to a repository: those that its branches and tags lead to.
#include "git_ids.hpp"
#include "unit_test.hpp"

#include "core/git/git_history.hpp"
#include "core/git/git_tree.hpp"

#include <map>
#include <string>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(git_history)

namespace {

GitRef ref(std::string name, int number)
{
    GitRef made;
    made.name = std::move(name);
    made.id = id(number);
    return made;
}

std::string commit_object(std::vector<int> const& parents)
{
    auto text = "tree " + std::string(40, 'a') + "\n";
    for (auto const parent : parents)
        text += "parent " + to_hex(id(parent)) + "\n";
    return text + "author A <a> 0 +0000\n\nparent " + std::string(40, '9') + "\n";
}

/// Commits by number.
struct History
{
    std::map<GitObjectId, std::string> commits;
    mutable int asked = 0;

    bool has(int commit, std::vector<GitObjectId> const& tips) const
    {
        return is_in_git_history(id(commit), tips, [this](GitObjectId const& wanted) {
            ++asked;
            auto const found = commits.find(wanted);
            return found == commits.end() ? nullptr : &found->second;
        });
    }
};

} // namespace

BOOST_AUTO_TEST_CASE(a_commit_has_as_many_parents_as_its_head_says)
{
    BOOST_TEST(parents_of_commit(commit_object({})).empty());
    BOOST_TEST((parents_of_commit(commit_object({7})) == std::vector{id(7)}));
    BOOST_TEST((parents_of_commit(commit_object({7, 8, 9})) == std::vector{id(7), id(8), id(9)}));
}

BOOST_AUTO_TEST_CASE(what_is_no_commit_has_no_parents)
{
    auto const good = commit_object({7});
    for (std::size_t size = 0; size < 94; ++size)
        BOOST_TEST(parents_of_commit(good.substr(0, size)).empty(), size);
    BOOST_TEST(parents_of_commit("parent " + std::string(40, 'a') + "\n").empty());
    BOOST_TEST(parents_of_commit("object " + std::string(40, 'a') + "\ntype commit\n").empty());
}

BOOST_AUTO_TEST_CASE(branches_and_tags_are_tips_and_nothing_else_is)
{
    auto const tips = git_tips({ref("refs/heads/main", 1), ref("refs/heads/same", 1), ref("refs/tags/v1", 2),
                                ref("refs/pull/1/head", 3), ref("refs/merge-requests/1/head", 4),
                                ref("HEAD", 5), ref("refs/headsx", 6)});
    BOOST_TEST((tips == std::vector{id(1), id(2)}));
}

BOOST_AUTO_TEST_CASE(tips_and_their_ancestors_are_in_the_history_whichever_parent_leads_there)
{
    History history; // 1 ── 2 ── 4 (main), 3 ──┘, 5 ── 6 (tag), 1 ── 7 (a stranger's)
    history.commits = {{id(1), commit_object({})}, {id(2), commit_object({1})},
                       {id(3), commit_object({})}, {id(4), commit_object({2, 3})},
                       {id(5), commit_object({})}, {id(6), commit_object({5})},
                       {id(7), commit_object({1})}};
    for (int const commit : {1, 2, 3, 4, 5, 6})
        BOOST_TEST(history.has(commit, {id(4), id(6)}), commit);
    BOOST_TEST(!history.has(7, {id(4), id(6)}));
    BOOST_TEST(!history.has(5, {id(4)}));
    BOOST_TEST(!history.has(4, {id(2)}), "a descendant is no ancestor");
}

BOOST_AUTO_TEST_CASE(commits_that_are_not_there_lead_nowhere)
{
    History history;
    history.commits = {{id(1), commit_object({2})}};
    BOOST_TEST(history.has(2, {id(1)}), "it is named by its child");
    BOOST_TEST(!history.has(3, {id(1), id(9)}));
    BOOST_TEST(!history.has(3, {}));
}

BOOST_AUTO_TEST_CASE(each_commit_is_looked_at_once_however_many_ways_lead_there)
{
    History history; // 60 merges in a row, each of twice the same past: 2^60 ways
    for (int commit = 1; commit < 120; commit += 2) {
        history.commits[id(commit)] = commit_object({commit + 1, commit + 2});
        history.commits[id(commit + 1)] = commit_object({commit + 2});
    }
    BOOST_TEST(!history.has(1000, {id(1)}));
    BOOST_TEST(history.asked <= 121);
}

BOOST_AUTO_TEST_SUITE_END()
