#include "unit_test.hpp"

#include "core/projects/archive_path.hpp"

using namespace webots_cloud;
using core::archive_path;

BOOST_AUTO_TEST_SUITE(archive_path_of_an_entry)

BOOST_AUTO_TEST_CASE(ordinary_names_are_paths_and_folders_lose_their_slash)
{
    for (std::string const name : {"a", "worlds/a.wbt", "controllers/my robot/my robot.py", "caf\u00e9/-rf",
                                   ".hidden", "Icon\r", "h\xf6he.png", "a\nb"})
        BOOST_TEST(archive_path(name).value() == name);
    BOOST_TEST(archive_path("worlds/").value() == "worlds");
}

BOOST_AUTO_TEST_CASE(names_that_lead_elsewhere_are_refused)
{
    for (std::string const name : {"", "/", "/etc/passwd", "//x", "..", "../x", "a/../x", "a/..", ".", "./a",
                                   "a//b", "a//", "a\\b", ".git/config", "a/.GIT", ".git\xff/.git"}) {
        auto const path = archive_path(name);
        BOOST_TEST_REQUIRE(path.has_error(), name);
        BOOST_TEST((path.error() == errc::protocol_error), name);
        BOOST_TEST(path.error().message().starts_with("The project has a file with a forbidden name: "),
                   name);
    }
    BOOST_TEST(!archive_path(std::string_view("a\0b", 3)));
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
