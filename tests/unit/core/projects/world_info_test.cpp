#include "unit_test.hpp"

#include "core/projects/world_info.hpp"
#include "core/text.hpp"

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(world_info)

namespace {

constexpr std::string_view arena = R"(#VRML_SIM R2025a utf8

EXTERNPROTO "../protos/WalledArena.proto"

WorldInfo {
  info [
    "Two-wheeled robots that see walls"
    "and \"each other\"."
  ]
  title "Robots in an arena" # a comment with a } in it
  basicTimeStep 32
}
Robot { title "of something else" }
)";

} // namespace

BOOST_AUTO_TEST_CASE(title_and_info_are_those_of_the_node_world_info)
{
    auto const info = core::world_info(arena);
    BOOST_TEST(info.title == "Robots in an arena");
    BOOST_TEST(info.text == "Two-wheeled robots that see walls and \"each other\".");
}

BOOST_AUTO_TEST_CASE(nodes_within_world_info_have_titles_of_their_own)
{
    BOOST_TEST(core::world_info(R"(WorldInfo { physics X { title "inner" } info "one" })").title.empty());
    BOOST_TEST(
        core::world_info(R"(WorldInfo { contactProperties [ A { title "x" } ] title "outer" })").title ==
        "outer");
    BOOST_TEST(core::world_info(R"(WorldInfo { info "one" })").text == "one");
}

BOOST_AUTO_TEST_CASE(what_is_no_world_says_nothing)
{
    for (auto const* file :
         {"", "WorldInfo", "WorldInfo {", "WorldInfo { title", "WorldInfo { title [",
          "WorldInfo { title \"half", "# WorldInfo { title \"comment\" }", "\xff\xfe",
          "WorldInfo { title \"\xff\" }", "Other { title \"x\" }", "WorldInfo { title { \"x\" } }"}) {
        auto const info = core::world_info(file);
        BOOST_TEST(info.title == "", file);
        BOOST_TEST(info.text == "", file);
    }
}

BOOST_AUTO_TEST_CASE(a_project_is_published_unless_it_says_no)
{
    for (auto const* yml :
         {"", "type: demo\n", "publish: true\n", "publish:\n", "# publish: false\n", "  publish: false\n"})
        BOOST_TEST(core::is_published(yml), yml);
    for (auto const* yml : {"publish: false", "type: demo\r\npublish: False # not yet\r\n", "publish:no\n"})
        BOOST_TEST(!core::is_published(yml), yml);
}

BOOST_AUTO_TEST_CASE(only_the_beginning_of_a_file_is_read)
{
    std::string const blanks(core::world_info_bytes, ' ');
    BOOST_TEST(core::world_info(blanks + std::string(arena)).title.empty());
}

BOOST_AUTO_TEST_CASE(a_line_has_no_breaks_and_ends_after_a_whole_word)
{
    BOOST_TEST(core::one_line(" two\n\tlines \r\n", 100) == "two lines");
    BOOST_TEST(core::one_line("right\u202e to left", 100) == "right to left");
    BOOST_TEST(core::one_line("one two three four", 12) == "one two…");
    BOOST_TEST(core::one_line("exactly so", 10) == "exactly so");
    BOOST_TEST(core::one_line("Donaudampfschifffahrt", 10) == "Donauda…");
    BOOST_TEST(core::one_line("ロボットの競技場", 13) == "ロボッ…");
    BOOST_TEST(core::one_line("no \xff text", 100).empty());
    BOOST_TEST(core::one_line("", 100).empty());
}

BOOST_AUTO_TEST_SUITE_END()
