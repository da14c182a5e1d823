#include "git_ids.hpp"
#include "unit_test.hpp"

#include "core/git/git_problem.hpp"
#include "core/git/git_worlds.hpp"

#include <map>
#include <string>
#include <string_view>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(git_worlds)

namespace {

std::string item(std::string_view mode, std::string_view name, int number)
{
    auto const object = id(number);
    return std::string(mode) + " " + std::string(name) + std::string(1, '\0') +
           std::string(object.bytes.begin(), object.bytes.end());
}

std::string folder_item(std::string_view name, int number)
{
    return item("40000", name, number);
}

std::string file_item(std::string_view name, int number = 9)
{
    return item("100644", name, number);
}

/// The paths that are found from the tree 1, or which folder there is not.
std::string found(std::map<int, std::string> const& trees, std::string_view path = {},
                  GitWorldLimits const& limits = {})
{
    auto const lookup = [&trees](GitObjectId const& wanted) -> std::string const* {
        for (auto const& [number, tree] : trees)
            if (id(number) == wanted)
                return &tree;
        return nullptr;
    };
    auto const worlds = find_git_worlds(id(1), path, limits, lookup);
    if (!worlds)
        return (worlds.error() == GitProblem::no_such_folder ? "none: " : "") + worlds.error().detail();
    std::string text;
    for (auto const& world : *worlds)
        text += world.path + " ";
    return text;
}

} // namespace

BOOST_AUTO_TEST_CASE(worlds_are_files_in_folders_of_that_name_wherever_these_are)
{
    std::map<int, std::string> const trees{
        {1, file_item("map.wbt") + folder_item("src", 2) + folder_item("worlds", 3)},
        {2, folder_item("drive", 4)},
        {3, item("100755", "b.wbt", 9) + file_item(".wbt") + file_item("a.wbproj") +
                item("120000", "c.wbt", 9) + folder_item("d.wbt", 5) + file_item("my map.wbt")},
        {4, folder_item("worlds", 6) + item("160000", "module", 7)},
        {5, file_item("x.wbt")},
        {6, file_item("city.wbt")}};
    BOOST_TEST(found(trees) == "src/drive/worlds/city.wbt worlds/b.wbt worlds/my map.wbt ");
    BOOST_TEST(found(trees, "src") == "src/drive/worlds/city.wbt ");
    BOOST_TEST(found(trees, "worlds") == "worlds/b.wbt worlds/my map.wbt ");
    BOOST_TEST(found(trees, "worlds/d.wbt") == "");
    BOOST_TEST(found(trees, "src/other") == "none: src/other");
    BOOST_TEST(found(trees, "map.wbt") == "none: map.wbt");
}

BOOST_AUTO_TEST_CASE(names_that_no_address_has_are_left_out)
{
    BOOST_TEST(found({{1, folder_item("worlds", 2)},
                      {2, file_item("a\nb.wbt") + file_item("h\xf6he.wbt") + file_item("a\\b.wbt") +
                              file_item("caf\u00e9.wbt")}}) == "worlds/caf\u00e9.wbt ");
    BOOST_TEST(found({{1, folder_item("..", 2) + folder_item(".git", 2)},
                      {2, folder_item("worlds", 3)},
                      {3, file_item("a.wbt")}}) == "");
}

BOOST_AUTO_TEST_CASE(a_folder_in_itself_ends_at_the_limits)
{
    std::map<int, std::string> const endless{{1, folder_item("worlds", 1) + file_item("a.wbt")}};
    GitWorldLimits limits;
    limits.depth = 2;
    BOOST_TEST(found(endless, {}, limits) == "worlds/worlds/a.wbt worlds/a.wbt ");
    limits.worlds = 1;
    BOOST_TEST(found(endless, {}, limits) == "worlds/worlds/a.wbt ");
    limits = {};
    limits.entries = 3;
    BOOST_TEST(found(endless, {}, limits) == "");
}

BOOST_AUTO_TEST_CASE(what_is_no_tree_or_is_not_there_is_told)
{
    BOOST_TEST(found({}) == "the git server left out a folder");
    BOOST_TEST(found({{1, folder_item("a", 2)}}) == "the git server left out a folder");
    BOOST_TEST(found({{1, "nonsense"}}) != "");
}

BOOST_AUTO_TEST_SUITE_END()
