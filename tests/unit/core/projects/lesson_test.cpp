#include "core/projects/lesson.hpp"
#include "core/text.hpp"
#include "unit_test.hpp"

using namespace webots_cloud::core;
using webots_cloud::errc;
using webots_cloud::TextInLanguages;

BOOST_AUTO_TEST_SUITE(lesson)

BOOST_AUTO_TEST_CASE(its_file_is_beside_the_world)
{
    BOOST_TEST(lesson_file("worlds/a.b.wbt") == "worlds/a.b.lesson.json");
}

BOOST_AUTO_TEST_CASE(texts_are_for_one_language_or_for_everybody)
{
    auto const read =
        parse_lesson(R"({"title":{"en":"Move","zh-Hant":"移動"},"steps":["Go\n on",{"fr":"Avance"}],"by":3})")
            .value();
    BOOST_TEST((read.title == TextInLanguages{{"en", "Move"}, {"zh-Hant", "移動"}}));
    BOOST_TEST(read.about.empty());
    BOOST_TEST(lesson_message(read) == R"(lesson: {"title":{"en":"Move","zh-Hant":"移動"},"about":{},)"
                                       R"("steps":[{"":"Go on"},{"fr":"Avance"}]})");
}

BOOST_AUTO_TEST_CASE(what_is_wrong_is_said_in_a_sentence)
{
    auto const fault = [](std::string_view file) { return parse_lesson(file).error(); };
    for (auto const* file : {"", "[]", R"({"title":)", "\xff"})
        BOOST_TEST(fault(file).detail() == "It is no JSON object.", file);
    for (auto const* file :
         {R"({"title":1})", R"({"about":{"d":"x"}})", R"({"title":{"d<":"x"}})", R"({"title":{"en":["x"]}})"})
        BOOST_TEST(fault(file).detail().starts_with("\"title\" and \"about\" must be texts"), file);
    BOOST_TEST(fault(R"({"steps":{"en":"x"}})").detail() == "\"steps\" must be a list of at most 20 texts.");
    BOOST_TEST(fault(R"({"steps":[3]})").detail().starts_with("Each of \"steps\""));
    BOOST_TEST((fault(std::string(largest_lesson + 1, ' ')) == errc::invalid_argument));
    BOOST_TEST(lesson_left_out_message("worlds/\x1b.lesson.json", fault("[]")) ==
               R"(stderr:worlds/\x1b.lesson.json is left out: It is no JSON object.)");
}

BOOST_AUTO_TEST_CASE(there_are_not_too_many_languages_and_steps_and_texts_are_short)
{
    std::string languages, steps;
    for (char c = 'a'; c <= 'u'; ++c) {
        languages += concat(languages.empty() ? "" : ",", R"("a)", std::string(1, c), R"(":"x")");
        steps += steps.empty() ? R"("x")" : R"(,"x")";
    }
    BOOST_TEST(!parse_lesson(concat(R"({"title":{)", languages, "}}")));
    BOOST_TEST(!parse_lesson(concat(R"({"steps":[)", steps, "]}")));
    std::string escaped;
    for (std::size_t i = 0; i < 14'000; ++i)
        escaped += R"(\")";
    auto const read = parse_lesson(concat(R"({"title":")", escaped, R"("})")).value();
    BOOST_TEST(read.title.at("").size() <= 100u);
    BOOST_TEST(lesson_message(read).size() < 64u * 1024);
}

BOOST_AUTO_TEST_SUITE_END()
