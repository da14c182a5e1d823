#include "core/simulation/editable_files.hpp"
#include "unit_test.hpp"

using namespace webots_cloud::core;
using namespace std::chrono_literals;

using webots_cloud::errc;
using webots_cloud::TimePoint;

BOOST_AUTO_TEST_SUITE(editable_files)

namespace {

EditableFiles two_programs()
{
    return EditableFiles({{"drive/drive.py", "go\n"}, {"turn/turn.c", "turn"}}, "");
}

} // namespace

BOOST_AUTO_TEST_CASE(what_is_no_text_or_too_large_is_not_shown)
{
    EditableFiles const files({{"a/a.py", "print(1)\r\n\tä"},
                               {"a/latin.py", "h\xf6he"},
                               {"a/nul.py", std::string(1, '\0')},
                               {"a/escape.py", "\x1b[2J"},
                               {"a/large.py", std::string(largest_editable + 1, ' ')},
                               {"a.py", "in no folder of a controller"}},
                              "");
    BOOST_TEST(files.list_message() == R"(files: [{"path":"a/a.py","changed":false}])");
}

BOOST_AUTO_TEST_CASE(not_more_files_are_shown_than_fit_into_a_message)
{
    EditableFiles::Texts texts;
    for (std::size_t i = 0; i < 2 * most_editable; ++i)
        texts.emplace("a/" + std::to_string(1'000 + i) + std::string(180, '\\'), "");
    BOOST_TEST(EditableFiles(texts, "").empty()); // a backslash could do harm
    texts.clear();
    for (std::size_t i = 0; i < 2 * most_editable; ++i)
        texts.emplace("a/" + std::to_string(1'000 + i) + std::string(180, '"'), "");
    BOOST_TEST(EditableFiles(texts, "").list_message().size() < 64u * 1024);
    BOOST_TEST(file_message("a/a.py", std::string(largest_editable, '"'), false).size() < 64u * 1024);
}

BOOST_AUTO_TEST_CASE(the_controllers_of_the_world_come_first)
{
    EditableFiles const files(
        {{"exit/exit.py", ""}, {"move/map.py", ""}, {"move/move.py", ""}, {"walls/walls.py", ""}},
        "Robot { controller  \"move\" controllerArgs [ \"exit\" ] } DEF controller \"");
    BOOST_TEST(files.list_message() ==
               R"(files: [{"path":"move/map.py","changed":false},{"path":"move/move.py","changed":false},)"
               R"({"path":"exit/exit.py","changed":false},{"path":"walls/walls.py","changed":false}])");
}

BOOST_AUTO_TEST_CASE(a_text_is_read_as_it_is_now_and_as_it_was)
{
    auto files = two_programs();
    BOOST_TEST(files.may_save("drive/drive.py", "stop\n", TimePoint()).has_value());
    files.saved("drive/drive.py", "stop\n");
    BOOST_TEST(files.read("drive/drive.py", false).value() == "stop\n");
    BOOST_TEST(files.read("drive/drive.py", true).value() == "go\n");
    BOOST_TEST(files.list_message().find(R"({"path":"drive/drive.py","changed":true})") != std::string::npos);
    files.restored("drive/drive.py");
    BOOST_TEST(files.read("drive/drive.py", false).value() == "go\n");
    BOOST_TEST((files.read("drive/other.py", false).error() == errc::not_found));
}

BOOST_AUTO_TEST_CASE(a_new_file_is_made_in_a_folder_of_the_project_only)
{
    auto files = two_programs();
    BOOST_TEST(files.may_save("drive/map.py", "", TimePoint()).has_value());
    files.saved("drive/map.py", "");
    BOOST_TEST(files.read("drive/map.py", true).value().empty());
    for (auto const* name :
         {"other/map.py", "driv/map.py", "map.py", "drive/../turn/x", "drive/.git/config", "/drive/x",
          "drive//x", "drive/", "drive/a\nb", "drive/a\\b", "drive/deeper/x.py"})
        BOOST_TEST((files.may_save(name, "", TimePoint()).error() == errc::not_found), name);
}

BOOST_AUTO_TEST_CASE(what_is_too_large_or_no_text_is_not_saved)
{
    auto files = two_programs();
    auto const of = [&files](std::string const& text) {
        return files.may_save("drive/drive.py", text, TimePoint());
    };
    BOOST_TEST(of(std::string(largest_editable, 'x')).has_value());
    BOOST_TEST((of(std::string(largest_editable + 1, 'x')).error() == errc::too_large));
    BOOST_TEST((of(std::string(1, '\0')).error() == errc::invalid_argument));
    BOOST_TEST((of("\xff").error() == errc::invalid_argument));
}

BOOST_AUTO_TEST_CASE(there_is_an_end_to_new_files)
{
    auto files = two_programs();
    TimePoint now;
    int made = 0;
    for (; made < 1'000; ++made, now += 1s) {
        auto const name = "drive/" + std::to_string(made);
        if (!files.may_save(name, "", now))
            break;
        files.saved(name, "");
    }
    BOOST_TEST(static_cast<std::size_t>(made) == most_editable - 2);
    BOOST_TEST((files.may_save("drive/one_more", "", now).error() == errc::too_large));
    BOOST_TEST(files.may_save("drive/drive.py", "", now).has_value());
}

BOOST_AUTO_TEST_CASE(saving_is_limited_in_the_long_run_and_not_for_a_burst)
{
    auto files = two_programs();
    TimePoint now{1h};
    int saved = 0;
    for (auto const end = now + 10s; now < end; now += 1ms) // 1,000 a second
        saved += files.may_save("drive/drive.py", "x", now).has_value() ? 1 : 0;
    BOOST_TEST(saved >= 20);
    BOOST_TEST(saved <= 41);
    (void)files.may_save("drive/drive.py", "x", now); // perhaps its turn
    BOOST_TEST((files.may_save("drive/drive.py", "x", now).error() == errc::refused));
    BOOST_TEST(files.may_save("drive/drive.py", "x", now + 1s).has_value());
}

BOOST_AUTO_TEST_CASE(what_a_page_is_told_of_a_file_names_it)
{
    BOOST_TEST(file_message("a/a.py", "x\n", false) == R"(file: {"path":"a/a.py","text":"x\n"})");
    BOOST_TEST(file_message("a/a.py", "x\n", true) == R"(file: {"path":"a/a.py","original":"x\n"})");
    BOOST_TEST(file_saved_message("a/a.py") == R"(file: {"path":"a/a.py","saved":true})");
    auto files = two_programs();
    auto const refusal = files.may_save("b/b.py", "", TimePoint());
    auto const text = file_error_message("b/b.py", refusal.error());
    BOOST_TEST(text.starts_with(R"(file: {"path":"b/b.py","error":")"));
    BOOST_TEST(text.ends_with(R"("code":"no-file","values":{"file":"b/b.py"}})"));
}

BOOST_AUTO_TEST_CASE(folders_with_sources_of_their_own_can_be_compiled)
{
    EditableFiles files({{"drive/drive.c", ""},
                         {"drive/wheels.c", ""},
                         {"fly/fly.cpp", ""},
                         {"fly/Makefile", ""},
                         {"look/look.py", ""},
                         {"turn/lib/turn.c", ""}},
                        "");
    auto const compiled = files.compiled_controllers();
    BOOST_TEST((compiled == std::vector<std::string>{"drive", "fly"}));
    BOOST_TEST(compiles_message(compiled) == R"(compiles: ["drive","fly"])");
    BOOST_TEST(files.has_makefile("fly"));
    BOOST_TEST(!files.has_makefile("drive"));
    files.saved("drive/Makefile", "all:");
    BOOST_TEST(files.has_makefile("drive"));
    BOOST_TEST(files.may_compile("drive", TimePoint()).has_value());
    for (auto const* const other : {"look", "turn", "turn/lib", "..", "", "driv"})
        BOOST_TEST((files.may_compile(other, TimePoint()).error() == errc::refused), other);
}

BOOST_AUTO_TEST_CASE(compiling_counts_as_saving_does)
{
    auto files = two_programs();
    TimePoint const now{1h};
    int compiled = 0;
    for (int i = 0; i < 1'000; ++i)
        compiled += files.may_compile("turn", now).has_value() ? 1 : 0;
    BOOST_TEST(compiled <= 21);
    BOOST_TEST((files.may_save("drive/drive.py", "x", now).error() == errc::refused));
}

BOOST_AUTO_TEST_CASE(what_a_compiler_prints_becomes_text_for_a_page)
{
    BOOST_TEST(compiled_message("drive", "", {}) == R"(compiled: {"controller":"drive","output":""})");
    auto files = two_programs();
    auto const text = compiled_message("drive", "drive.c:1:2: error: \xff\x1b[m\nend\n\n",
                                       files.may_compile("drive", TimePoint()));
    BOOST_TEST(text.starts_with(R"(compiled: {"controller":"drive","output":"drive.c:1:2: error: )"
                                R"(\\xff\\x1b[m\nend","error":")"));
    BOOST_TEST(text.ends_with(R"("code":"no-compiler","values":{"controller":"drive"}})"));
}

BOOST_AUTO_TEST_SUITE_END()
