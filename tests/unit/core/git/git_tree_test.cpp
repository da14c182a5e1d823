// Trees, commits, and what a folder becomes on disk.
#include "git_ids.hpp"
#include "unit_test.hpp"

#include "core/git/git_layout.hpp"
#include "core/git/git_problem.hpp"
#include "core/git/git_tree.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <map>
#include <string>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(git_tree)

using Kind = GitTreeEntry::Kind;

namespace {

std::string entry(std::string const& mode, std::string const& name, int number)
{
    auto const object = id(number);
    return mode + " " + name + std::string(1, '\0') + std::string(object.bytes.begin(), object.bytes.end());
}

/// Trees by number.
struct Repository
{
    std::map<GitObjectId, std::string> trees;

    GitTreeLookup lookup() const
    {
        return [this](GitObjectId const& wanted) {
            auto const found = trees.find(wanted);
            return found == trees.end() ? nullptr : &found->second;
        };
    }

    /// The paths, or what is wrong.
    std::string layout(int tree, GitLayoutLimits const& limits = {}) const
    {
        GitWay way;
        way.tree = id(tree);
        return layout(way, limits);
    }

    /// The same for a folder below the tree 1.
    std::string layout(std::string_view folder, GitLayoutLimits const& limits = {}) const
    {
        auto way = find_git_folder(id(1), folder, limits, lookup());
        return way ? layout(*way, limits) : way.error().message();
    }

    std::string layout(GitWay& way, GitLayoutLimits const& limits) const
    {
        auto const items = lay_out_git_folder(way, limits, lookup());
        if (!items)
            return items.error().message();
        std::string text;
        for (auto const& item : *items)
            text += "fxld"[static_cast<int>(item.kind)] + (":" + item.path + " ");
        return text;
    }
};

std::string const forbidden = "The project has a file with a forbidden name: ";

} // namespace

BOOST_AUTO_TEST_CASE(entries_have_a_kind_a_name_and_an_id)
{
    auto const tree =
        parse_git_tree(entry("100644", "a", 1) + entry("100755", "b", 2) + entry("120000", "c", 3) +
                       entry("40000", "d", 4) + entry("160000", "e", 5));
    BOOST_REQUIRE(tree.has_value());
    BOOST_REQUIRE(tree->size() == 5u);
    Kind const kinds[] = {Kind::file, Kind::executable, Kind::link, Kind::folder, Kind::submodule};
    for (std::size_t i = 0; i < 5; ++i) {
        BOOST_TEST(((*tree)[i].kind == kinds[i]));
        BOOST_TEST(((*tree)[i].id == id(static_cast<int>(i) + 1)));
    }
    BOOST_TEST((*tree)[3].name == "d");
}

BOOST_AUTO_TEST_CASE(malformed_trees_are_errors)
{
    auto const good = entry("100644", "name", 1);
    for (std::size_t size = 1; size < good.size(); ++size)
        BOOST_TEST(parse_git_tree(good.substr(0, size)).has_error(), size);
    BOOST_TEST(parse_git_tree(entry("100666", "device", 1)).has_error());
    BOOST_TEST(parse_git_tree(entry("", "x", 1)).has_error());
}

BOOST_AUTO_TEST_CASE(a_commit_names_its_tree)
{
    std::string const hex(40, 'a');
    BOOST_TEST(to_hex(tree_of_commit("tree " + hex + "\nparent ...").value()) == hex);
    BOOST_TEST(tree_of_commit("tree " + hex).has_error());
    BOOST_TEST(tree_of_commit("parent " + hex + "\n").has_error());
    BOOST_TEST(tree_of_commit("").has_error());
}

BOOST_AUTO_TEST_CASE(folders_come_before_what_is_in_them)
{
    Repository repository;
    repository.trees[id(1)] = entry("40000", "worlds", 2) + entry("100644", "x", 9);
    repository.trees[id(2)] = entry("100644", "demo.wbt", 8) + entry("120000", "link", 7);
    BOOST_TEST(repository.layout(1) == "d:worlds f:worlds/demo.wbt l:worlds/link f:x ");
}

BOOST_AUTO_TEST_CASE(a_folder_is_found_by_its_path)
{
    Repository repository;
    repository.trees[id(1)] = entry("40000", "a", 2) + entry("100644", "f", 9);
    repository.trees[id(2)] = entry("40000", "b", 3);
    repository.trees[id(3)] = "";
    auto const lookup = repository.lookup();
    BOOST_TEST((find_git_folder(id(1), "", {}, lookup).value().tree == id(1)));
    BOOST_TEST((find_git_folder(id(1), "a/b", {}, lookup).value().tree == id(3)));
    for (auto const* const path : {"b", "a/c", "f", "a/b/c", "A"})
        BOOST_TEST((find_git_folder(id(1), path, {}, lookup).error() == GitProblem::no_such_folder), path);
}

/// With a project in `a/b`.
Repository repository_with_a_folder()
{
    Repository repository;
    repository.trees[id(1)] = entry("40000", "a", 2) + entry("100644", "read", 9) +
                              entry("40000", "others", 5) + entry("160000", "module", 8);
    repository.trees[id(2)] =
        entry("40000", "b", 3) + entry("120000", "link", 7) + entry("100755", "tool", 6);
    repository.trees[id(3)] = entry("40000", "worlds", 4) + entry("100644", "x", 9);
    repository.trees[id(4)] = entry("100644", "demo.wbt", 8);
    return repository;
}

BOOST_AUTO_TEST_CASE(a_folder_comes_with_the_files_of_those_that_it_lies_in)
{
    auto const repository = repository_with_a_folder();
    BOOST_TEST(repository.layout("a/b") ==
               "f:read d:a l:a/link x:a/tool d:a/b d:a/b/worlds f:a/b/worlds/demo.wbt f:a/b/x ");
    auto way = find_git_folder(id(1), "a/b", {}, repository.lookup()).value();
    BOOST_TEST(way.path == "a/b");
    std::string of_parents;
    for (auto const& item : way.items)
        of_parents += item.of_parent ? item.path + " " : "";
    BOOST_TEST(of_parents == "read a/link a/tool ");
}

BOOST_AUTO_TEST_CASE(a_folder_that_is_called_like_gits_own_is_refused)
{
    for (auto const* folder : {"git~1", ".GIT"}) {
        Repository repository;
        repository.trees[id(1)] = entry("40000", folder, 2);
        repository.trees[id(2)] = entry("100644", "demo.wbt", 8);
        BOOST_TEST(repository.layout(folder).ends_with("has a forbidden name."), folder);
    }
}

BOOST_AUTO_TEST_CASE(too_many_files_beside_the_way_are_left_out_all_together)
{
    auto repository = repository_with_a_folder();
    auto const without = "d:a d:a/b d:a/b/worlds f:a/b/worlds/demo.wbt f:a/b/x ";
    GitLayoutLimits limits;
    limits.parent_files = 3;
    BOOST_TEST(repository.layout("a/b", limits) != without);
    limits.parent_files = 2;
    BOOST_TEST(repository.layout("a/b", limits) == without);
    limits = GitLayoutLimits();
    limits.items = 7; // three of the project, three beside the way, which are five with its folders
    BOOST_TEST(repository.layout("a/b", limits) == without);
    limits.items = 8;
    BOOST_TEST(repository.layout("a/b", limits) != without);
    limits.items = 2;
    BOOST_TEST(repository.layout("a/b", limits) == "The project has more than 2 files.");
    limits = GitLayoutLimits();
    limits.parent_bytes = repository.trees[id(2)].size();
    BOOST_TEST(repository.layout("a/b", limits) == without); // the root's is larger
    auto const way = find_git_folder(id(1), "a/b", limits, repository.lookup()).value();
    BOOST_TEST(way.left_out);
}

// Without the files beside the project, these would not have been read.
BOOST_AUTO_TEST_CASE(forbidden_names_beside_the_way_are_left_out_and_refuse_nobody)
{
    auto repository = repository_with_a_folder();
    for (auto const* const name : {"..", ".", ".git", ".GIT.", "git~1", "a/b", "a\\b", "read"})
        repository.trees[id(1)] += entry("100644", name, 9);
    repository.trees[id(1)] += entry("120000", "a", 7); // in the place of the folder
    BOOST_TEST(repository.layout("a/b") ==
               "f:read d:a l:a/link x:a/tool d:a/b d:a/b/worlds f:a/b/worlds/demo.wbt f:a/b/x ");
}

BOOST_AUTO_TEST_CASE(a_way_through_a_forbidden_name_is_refused)
{
    Repository repository;
    for (auto const* const name : {".git", "..", "GIT~1"}) {
        repository.trees[id(1)] = entry("40000", name, 2);
        repository.trees[id(2)] = "";
        auto const way = find_git_folder(id(1), name, {}, repository.lookup());
        BOOST_TEST((way.error() == errc::invalid_url), name);
    }
}

BOOST_AUTO_TEST_CASE(submodules_are_left_out)
{
    Repository repository;
    repository.trees[id(1)] = entry("160000", "module", 5) + entry("100644", "x", 9);
    BOOST_TEST(repository.layout(1) == "f:x ");
}

BOOST_AUTO_TEST_CASE(forbidden_names_are_left_out_and_told)
{
    for (std::string const name : {"..", ".", "", ".git", ".GIT.", "git~1", "a/b", "a\\b", ".git\xff/.."}) {
        Repository repository;
        repository.trees[id(1)] = entry("40000", "folder", 2) + entry("100644", "x", 9);
        for (std::string const mode :
             {"100644", "100755", "120000", "40000"}) { // what is in a folder does not matter
            repository.trees[id(2)] = entry(mode, name, 3) + entry("100644", "y", 9);
            GitWay way;
            way.tree = id(1);
            BOOST_TEST(repository.layout(way, {}) == "d:folder f:folder/y f:x ", name);
            BOOST_TEST(way.forbidden == std::vector<std::string>{printable("folder/" + name)},
                       boost::test_tools::per_element());
        }
        repository.trees[id(2)] = entry("160000", name, 3);
        BOOST_TEST(repository.layout(1) == "d:folder f:x ", name);
    }
}

BOOST_AUTO_TEST_CASE(odd_names_are_laid_down_as_they_are)
{
    for (std::string const name : {"Icon\r", "h\xf6he.png", "a\nb", "\x1b[2J", "\u202e"}) {
        Repository repository;
        repository.trees[id(1)] = entry("100644", name, 9) + entry("40000", "d" + name, 2);
        repository.trees[id(2)] = entry("100755", name, 9);
        BOOST_TEST(repository.layout(1) == "f:" + name + " d:d" + name + " x:d" + name + "/" + name + " ",
                   printable(name));
        repository.trees[id(3)] = entry("100644", name, 9) + entry("40000", "p", 4);
        auto way = find_git_folder(id(3), "p", {}, repository.lookup()).value();
        BOOST_TEST_REQUIRE(way.items.size() == 2u);
        BOOST_TEST(way.items.front().path == name);
    }
}

BOOST_AUTO_TEST_CASE(of_many_forbidden_names_the_first_are_told)
{
    Repository repository;
    for (int i = 0; i < 100; ++i)
        repository.trees[id(1)] += entry("100644", std::to_string(i) + "\\" + std::string(300, 'x'), 9);
    GitWay way;
    way.tree = id(1);
    BOOST_TEST(repository.layout(way, {}) == "");
    BOOST_TEST(way.forbidden.size() == core::max_forbidden);
    BOOST_TEST(way.forbidden.front().size() <= 203u);
}

BOOST_AUTO_TEST_CASE(a_name_that_occurs_twice_refuses_the_whole_project)
{
    Repository repository;
    repository.trees[id(1)] = entry("120000", "a", 3) + entry("40000", "a", 2);
    repository.trees[id(2)] = entry("100644", "x", 9);
    BOOST_TEST(repository.layout(1) == forbidden + "\"a\".");
}

BOOST_AUTO_TEST_CASE(names_that_differ_in_case_are_different_files)
{
    Repository repository;
    repository.trees[id(1)] = entry("100644", "A", 1) + entry("100644", "a", 2);
    BOOST_TEST(repository.layout(1) == "f:A f:a ");
}

BOOST_AUTO_TEST_CASE(a_missing_folder_is_an_error)
{
    Repository repository;
    repository.trees[id(1)] = entry("40000", "a", 2);
    BOOST_TEST(repository.layout(1) == "the git server left out a folder");
}

BOOST_AUTO_TEST_CASE(folders_that_hold_each_other_many_times_end_at_the_limit)
{
    Repository repository; // 30 levels of ten each: 10^30 files in 4 kB
    for (int level = 1; level <= 30; ++level)
        for (char name = 'a'; name < 'k'; ++name)
            repository.trees[id(level)] += entry("40000", std::string(1, name), level + 1);
    repository.trees[id(31)] = entry("100644", "x", 99);
    GitLayoutLimits limits;
    limits.items = 1000;
    BOOST_TEST(repository.layout(1, limits) == "The project has more than 1000 files.");
}

BOOST_AUTO_TEST_CASE(folders_of_nothing_but_submodules_end_at_the_limit_too)
{
    Repository repository; // one folder of 100 submodules, shown 900 times
    for (int i = 0; i < 900; ++i)
        repository.trees[id(1)] += entry("40000", "f" + std::to_string(i), 2);
    for (int i = 0; i < 100; ++i)
        repository.trees[id(2)] += entry("160000", "m" + std::to_string(i), 3);
    GitLayoutLimits limits;
    limits.items = 1000;
    BOOST_TEST(repository.layout(1, limits) == "The project has more than 1000 files.");
    limits.items = 900 + 900 * 100;
    BOOST_TEST(repository.layout(1, limits).starts_with("d:f0 d:f1 "));
}

// Entries of all folders on the way are in memory at once.
BOOST_AUTO_TEST_CASE(a_folder_counts_as_a_whole_before_its_own_folders_are_looked_into)
{
    Repository repository;
    repository.trees[id(1)] = entry("40000", "a", 2);
    for (int i = 0; i < 1000; ++i)
        repository.trees[id(1)] += entry("100644", "f" + std::to_string(i), 3);
    GitLayoutLimits limits;
    limits.items = 1000;
    BOOST_TEST(repository.layout(1, limits) == "The project has more than 1000 files.");
}

BOOST_AUTO_TEST_CASE(a_folder_without_end_and_a_name_without_end_are_refused)
{
    std::string tree;
    for (int i = 0; i < 100'000; ++i)
        tree += entry("100644", "f" + std::to_string(i), 3);
    BOOST_TEST(parse_git_tree(tree).value().size() == 100'000u);
    tree += entry("100644", "one more", 3);
    BOOST_TEST(parse_git_tree(tree).error().message() == "The repository has a folder with too many files.");
    BOOST_TEST((parse_git_tree(entry("100644", std::string(5000, 'x'), 1)).error() == GitProblem::malformed));
}

BOOST_AUTO_TEST_CASE(all_paths_together_are_limited)
{
    Repository repository;
    for (int i = 0; i < 100; ++i)
        repository.trees[id(1)] += entry("100644", std::string(200, 'x') + std::to_string(i), 3);
    GitLayoutLimits limits;
    limits.path_bytes = 20'000;
    BOOST_TEST(repository.layout(1, limits) == "The project has too many files with long paths.");
}

BOOST_AUTO_TEST_CASE(depth_and_length_of_paths_are_limited)
{
    Repository repository;
    for (int level = 1; level <= 100; ++level)
        repository.trees[id(level)] = entry("40000", "abcdefghij", level + 1);
    repository.trees[id(101)] = "";
    GitLayoutLimits limits;
    limits.path_length = 100'000;
    BOOST_TEST(repository.layout(1, limits) == "The project has folders that are nested too deeply.");
    limits.path_length = 100;
    BOOST_TEST(repository.layout(1, limits) == "The project has a file whose path is too long.");
}

BOOST_AUTO_TEST_SUITE_END()
