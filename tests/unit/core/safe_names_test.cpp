// Names and links in hostile repositories.
#include "unit_test.hpp"

#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <string>

using namespace webots_cloud::core;
using namespace std::string_view_literals;

BOOST_AUTO_TEST_SUITE(safe_names)

BOOST_AUTO_TEST_CASE(the_folder_of_git_is_recognised_in_every_spelling)
{
    for (auto const name : {".git"sv, ".GIT"sv, ".Git"sv, ".git."sv, ".git..."sv, ".git "sv, ".git . "sv,
                            "git~1"sv, "GIT~1"sv, "git~1."sv, ".git:stream"sv, ".git::$INDEX_ALLOCATION"sv,
                            ".g\u200cit"sv, "\ufeff.git"sv, ".git\u200f"sv, ".\u202agi\u206ft"sv})
        BOOST_TEST(is_dot_git(name), name);
}

BOOST_AUTO_TEST_CASE(names_that_only_look_like_it_are_fine)
{
    for (auto const name :
         {".gitignore"sv, ".gitattributes"sv, ".gitmodules"sv, "git"sv, ".git2"sv, "x.git"sv, "git~2"sv})
        BOOST_TEST(!is_dot_git(name), name);
}

BOOST_AUTO_TEST_CASE(ordinary_names_are_safe)
{
    for (auto const name : {"demo.wbt"sv, "my world (2).wbt"sv, "-rf"sv, "$(reboot)"sv, "`id`"sv,
                            "...three"sv, "Grüße.proto"sv, "世界.wbt"sv, ".hidden"sv, "a'b\"c"sv, "CON"sv})
        BOOST_TEST(is_safe_file_name(name), name);
    BOOST_TEST(is_safe_file_name(std::string(255, 'a')));
}

BOOST_AUTO_TEST_CASE(names_that_lead_elsewhere_or_hide_something_are_not)
{
    for (auto const name : {""sv, "."sv, ".."sv, "a/b"sv, "/"sv, "a\\b"sv, "a\nb"sv, "a\0b"sv, "\x1b[2J"sv,
                            "a\x7f"sv, "\xff"sv, "\xc0\xae\xc0\xae"sv, ".git"sv, ".GIT "sv})
        BOOST_TEST(!is_safe_file_name(name), name);
    BOOST_TEST(!is_safe_file_name(std::string(256, 'a')));
}

BOOST_AUTO_TEST_CASE(odd_names_of_files_do_no_harm)
{
    for (auto const name :
         {"Icon\r"sv, "h\xf6he.png"sv, "a\nb"sv, "\x1b[2J"sv, "\x7f"sv, "\xff"sv, "\xc0\xae\xc0\xae"sv, " "sv,
          "..."sv, "a\tb"sv, "\u202egnp.exe"sv, ".gitignore"sv, "a:b"sv, "'&#[]%!\""sv}) {
        BOOST_TEST(is_harmless_file_name(name), printable(name));
    }
    for (auto const name : {""sv, "."sv, ".."sv, "a/b"sv, "/"sv, "a\\b"sv, "..\\x"sv, "a\0b"sv, ".git"sv,
                            ".GIT "sv, "git~1"sv, ".g\u200cit"sv})
        BOOST_TEST(!is_harmless_file_name(name), printable(name));
    BOOST_TEST(is_harmless_file_name(std::string(255, '\xff')));
    BOOST_TEST(!is_harmless_file_name(std::string(256, 'a')));
}

BOOST_AUTO_TEST_CASE(a_link_may_point_to_anything_at_or_below_the_project)
{
    BOOST_TEST(link_stays_inside("meshes/arm.obj", 0));
    BOOST_TEST(link_stays_inside("./arm.obj", 0));
    BOOST_TEST(link_stays_inside("..", 1));
    BOOST_TEST(link_stays_inside("../protos", 1));
    BOOST_TEST(link_stays_inside("../../protos/Arm.proto", 2));
    BOOST_TEST(link_stays_inside("../.././protos", 2));
    BOOST_TEST(link_stays_inside("..hidden/...", 0));
    BOOST_TEST(link_stays_inside("../Icon\r", 1));
    BOOST_TEST(link_stays_inside("h\xf6he\n.png", 0));
}

BOOST_AUTO_TEST_CASE(a_link_that_could_leave_the_project_is_refused)
{
    for (auto const target : {"/etc/passwd"sv, "/"sv, "//host"sv, ".."sv, "../x"sv, "../../x"sv, "./.."sv,
                              "a/.."sv, "a/../.."sv, "a/../b"sv, "a/b/../../.."sv, ""sv, "a\0/../.."sv})
        BOOST_TEST(!link_stays_inside(target, 0), target);
    BOOST_TEST(!link_stays_inside("../..", 1));
    BOOST_TEST(!link_stays_inside("../a/../..", 2)); // `a` may itself be a link
    BOOST_TEST(!link_stays_inside(std::string(1024, 'a'), 0));
}

BOOST_AUTO_TEST_CASE(python_files_and_names_without_an_extension_can_be_run)
{
    for (auto const* name : {"a.py", ".py", "controller", "Makefile"})
        BOOST_TEST(is_runnable_name(name), name);
    for (auto const* name : {"a.wbt", "a.pyc", ".hidden", "a.", "a.py.txt"})
        BOOST_TEST(!is_runnable_name(name), name);
}

BOOST_AUTO_TEST_SUITE_END()
