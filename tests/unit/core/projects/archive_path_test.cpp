#include "unit_test.hpp"

#include "core/projects/archive_path.hpp"

using namespace webots_cloud;
using core::archive_path;

BOOST_AUTO_TEST_SUITE(archive_path_of_an_entry)

namespace {

std::string allowed(std::string_view name)
{
    auto const place = archive_path(name).value();
    return place.is_forbidden ? "it is left out" : place.path;
}

} // namespace

BOOST_AUTO_TEST_CASE(ordinary_names_are_paths_and_folders_lose_their_slash)
{
    for (std::string const name : {"a", "worlds/a.wbt", "controllers/my robot/my robot.py", "caf\u00e9/-rf",
                                   ".hidden", "Icon\r", "h\xf6he.png", "a\nb"})
        BOOST_TEST(allowed(name) == name);
    BOOST_TEST(allowed("worlds/") == "worlds");
}

BOOST_AUTO_TEST_CASE(names_that_lead_elsewhere_are_left_out_up_to_the_part_that_does)
{
    std::pair<std::string_view, std::string_view> const names[] = {
        {"", ""},
        {"/", ""},
        {"/etc/passwd", ""},
        {"//x", ""},
        {"..", ".."},
        {"../x", ".."},
        {"a/../x", "a/.."},
        {"a/..", "a/.."},
        {".", "."},
        {"./a", "."},
        {"a//b", "a/"},
        {"a//", "a/"},
        {"a\\b", "a\\b"},
        {".git/config", ".git"},
        {"a/.GIT", "a/.GIT"},
        {".git\xff/.git", ".git\xff/.git"},
        {"a/.git/objects/12/34", "a/.git"},
        {std::string_view("a\0b/c", 5), std::string_view("a\0b", 3)}};
    for (auto const& [name, told] : names) {
        auto const place = archive_path(name).value();
        BOOST_TEST(place.is_forbidden, name);
        BOOST_TEST(place.path == told);
    }
    BOOST_TEST(archive_path(std::string(256, 'a')).value().is_forbidden);
    BOOST_TEST(archive_path(".git/" + std::string(2000, 'a')).value().path == ".git");
}

BOOST_AUTO_TEST_CASE(length_and_depth_are_bounded)
{
    std::string deep = "a";
    for (int i = 1; i < 64; ++i)
        deep += "/a";
    BOOST_TEST(archive_path(deep).has_value());
    BOOST_TEST((archive_path(deep + "/a").error() == errc::too_large));
    std::string const part(200, 'a');
    auto const path = part + "/" + part + "/" + part + "/" + part + "/" + part;
    BOOST_TEST(archive_path(path).has_value());
    BOOST_TEST((archive_path(path + "/" + part).error() == errc::too_large));
}

BOOST_AUTO_TEST_SUITE_END()
