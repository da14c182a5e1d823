#include "unit_test.hpp"

#include "core/gallery/world_list.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

using namespace webots_cloud;
using core::concat;

BOOST_AUTO_TEST_SUITE(world_list)

namespace {

using Addresses = std::vector<std::string>;

ListedWorld world(std::string_view url, std::string_view title = {}, std::string_view text = {})
{
    ListedWorld listed{std::string(url)};
    listed.title = title;
    listed.text = text;
    return listed;
}

Addresses addresses(std::vector<ListedWorld> const& worlds)
{
    Addresses all;
    for (auto const& each : worlds)
        all.push_back(each.url);
    return all;
}

std::vector<ListedWorld> const found = {
    world("local:/demo/patrol/blob/main/worlds/patrol.wbt", "A robot on patrol"),
    world("local:/demo/robots/blob/main/worlds/arena.wbt", "Robots in an arena", "They see walls."),
    world("local:/demo/robots/blob/main/worlds/pick_and_place.wbt"),
};

} // namespace

BOOST_AUTO_TEST_CASE(without_a_list_all_worlds_are_shown_and_the_suggested_one_is_the_first)
{
    auto const shown = core::gallery_worlds(std::nullopt, found[1].url, found);
    BOOST_TEST(addresses(shown) == (Addresses{found[1].url, found[0].url, found[2].url}),
               boost::test_tools::per_element());
    BOOST_TEST(shown[0].title == "Robots in an arena");
    BOOST_TEST(shown[0].text == "They see walls.");
    BOOST_TEST(shown[2].title == "Pick and place");
    BOOST_TEST(core::gallery_worlds(std::nullopt, "", {}).empty());
    BOOST_TEST(core::gallery_worlds(std::nullopt, "no address", {}).empty());
}

BOOST_AUTO_TEST_CASE(of_a_list_its_order_and_its_words_count_and_machines_complete_them)
{
    auto first = world(found[1].url, "Lesson 1");
    first.group = "Basics";
    auto const shown = core::gallery_worlds(
        std::vector{first, world("https://github.com/o/r/blob/main/worlds/far.wbt", "", "From afar.")},
        "local:/a/b/blob/main/worlds/c.wbt", found);
    BOOST_TEST(shown.size() == 2u);
    BOOST_TEST(shown[0].title == "Lesson 1");
    BOOST_TEST(shown[0].text == "They see walls.");
    BOOST_TEST(shown[0].group == "Basics");
    BOOST_TEST(shown[1].title == "Far");
    BOOST_TEST(shown[1].text == "From afar.");
    BOOST_TEST(core::gallery_worlds(std::vector<ListedWorld>(), found[1].url, found).empty());
}

BOOST_AUTO_TEST_CASE(titles_in_languages_are_those_of_the_machine_unless_the_operator_has_one)
{
    auto lesson = world("local:/demo/lessons/blob/main/worlds/move.wbt", "Move", "Go.");
    lesson.titles = {{"", "Move"}, {"de", "Fahren"}, {"fr", "Avancer"}};
    lesson.texts = {{"de", "Los."}};
    auto const machine = core::parse_world_list(core::world_list_json(std::vector{lesson})).value();
    BOOST_TEST_REQUIRE(machine.size() == 1u);
    BOOST_TEST((machine[0] == lesson));
    auto const shown = core::gallery_worlds(std::vector{world(lesson.url)}, "", machine);
    BOOST_TEST((shown[0].titles == lesson.titles));
    BOOST_TEST(core::gallery_json(shown, {}) ==
               concat(R"({"worlds":[{"url":")", lesson.url,
                      R"(","title":"Move","text":"Go.","titles":{"":"Move","de":"Fahren","fr":"Avancer"},)"
                      R"("texts":{"de":"Los."}}]})"));
    auto const own = core::gallery_worlds(std::vector{world(lesson.url, "Lesson 1")}, "", machine);
    BOOST_TEST(own[0].titles.empty());
    BOOST_TEST((own[0].texts == lesson.texts));
    BOOST_TEST(
        core::parse_world_list(R"({"worlds":[{"url":"local:/a/b.wbt","titles":{"<":"x"},"texts":[]}]})")
            .value()[0]
            .titles.empty());
}

BOOST_AUTO_TEST_CASE(texts_in_languages_do_not_make_the_list_too_long)
{
    std::vector<ListedWorld> worlds;
    for (std::size_t i = 0; i < core::max_listed_worlds; ++i) {
        auto& each =
            worlds.emplace_back(world(concat("local:/o/r/blob/main/worlds/", std::to_string(i), ".wbt")));
        for (char c = 'a'; c < 'u'; ++c)
            each.texts[concat("a", std::string(1, c))] = std::string(200, '"');
    }
    auto const list = core::world_list_json(worlds);
    BOOST_TEST(list.size() < core::max_world_list);
    BOOST_TEST(!core::parse_world_list(list).value()[0].texts.empty());
    BOOST_TEST(core::parse_world_list(list).value().size() == core::max_listed_worlds);
}

BOOST_AUTO_TEST_CASE(a_folder_stands_for_the_worlds_that_machines_found_in_it)
{
    auto folder = world("local:/demo/robots/");
    folder.group = "Robots";
    auto const shown = core::gallery_worlds(std::vector{folder, world("local:/demo")}, "", found);
    BOOST_TEST(addresses(shown) == (Addresses{found[1].url, found[2].url, found[0].url}),
               boost::test_tools::per_element());
    BOOST_TEST(shown[1].group == "Robots");
    BOOST_TEST(shown[2].group.empty());
    BOOST_TEST(core::gallery_worlds(std::vector{world("local:/dem")}, "", found).empty());
}

BOOST_AUTO_TEST_CASE(the_number_of_worlds_is_limited)
{
    std::vector<ListedWorld> many;
    for (int i = 0; i < 300; ++i)
        many.push_back(world(concat("local:/a/b/blob/main/worlds/", std::to_string(i), ".wbt")));
    BOOST_TEST(core::gallery_worlds(std::nullopt, "", many).size() == core::max_listed_worlds);
    BOOST_TEST(core::parse_world_list(core::world_list_json(many))->size() == core::max_listed_worlds);
}

BOOST_AUTO_TEST_CASE(what_a_machine_writes_is_read_again)
{
    BOOST_TEST(core::world_list_json({}) == R"({"worlds":[]})");
    BOOST_TEST(
        core::world_list_json(std::span(found).first(1)) ==
        R"({"worlds":[{"url":"local:/demo/patrol/blob/main/worlds/patrol.wbt","title":"A robot on patrol"}]})");
    auto const read = core::parse_world_list(core::world_list_json(found));
    BOOST_TEST((read == found));
}

BOOST_AUTO_TEST_CASE(why_there_is_no_list_is_read_again_and_only_texts_of_it)
{
    auto const why = core::refused(core::Refused::no_repository, {{"name", "o/r"}});
    auto const text = core::world_list_error(why);
    BOOST_TEST(
        text ==
        R"({"error":"Repository o/r does not exist or is private.","code":"no-repository","values":{"name":"o/r"}})");
    BOOST_TEST(core::parse_world_list_error(text).value() == text);
    BOOST_TEST(core::world_list_error(Failure(errc::unavailable, "A sentence.")) ==
               R"({"error":"A sentence."})");
    for (auto const* no_error : {"", "[]", "{}", R"({"worlds":[]})", R"({"error":""})", R"({"error":1})"})
        BOOST_TEST(!core::parse_world_list_error(no_error), no_error);
    BOOST_TEST(core::parse_world_list_error(R"({"error":"a\u001b[2J","code":[],"values":{"a":{},"b":"c"}})")
                   .value() == R"({"error":"a\\x1b[2J","values":{"b":"c"}})");
}

BOOST_AUTO_TEST_CASE(of_a_machine_only_what_can_be_a_world_is_believed)
{
    for (auto const* no_list : {"", "[]", "1", "{}", R"({"worlds":{}})", R"({"worlds":[)"})
        BOOST_TEST(!core::parse_world_list(no_list), no_list);
    for (auto const* entry :
         {R"(1)", R"({})", R"({"url":1})", R"({"url":"a.wbt"})", R"({"url":"local:/a/b"})",
          R"({"url":"ws://evil.example/p/worlds/a.wbt"})", R"({"url":"WSS://evil.example/p/worlds/a.wbt"})",
          R"({"url":"local:/a b.wbt"})", R"({"url":"local:/<a>.wbt"})", R"({"url":"local:/\u202ea.wbt"})"})
        BOOST_TEST(core::parse_world_list(concat(R"({"worlds":[)", entry, "]}"))->empty(), entry);
    auto const long_address = concat("local:/", std::string(3000, 'a'), ".wbt");
    BOOST_TEST(core::parse_world_list(concat(R"({"worlds":[{"url":")", long_address, R"("}]})"))->empty());
    auto const read = core::parse_world_list(
        R"({"worlds":[{"url":"local:/a/b.wbt","title":"two\nlines","text":7,"group":"mine"}]})");
    BOOST_TEST(read->size() == 1u);
    BOOST_TEST(read->front().title == "two lines");
    BOOST_TEST(read->front().text.empty());
    BOOST_TEST(read->front().group.empty()); // headings are the operator's
}

BOOST_AUTO_TEST_CASE(pictures_are_known_by_keys_which_all_spellings_of_an_address_have)
{
    auto const key = core::picture_key("https://github.com/o/r/blob/main/worlds/a.wbt");
    BOOST_TEST(key.size() == 16u);
    BOOST_TEST(core::picture_key("https://github.com/o/r/tree/main/worlds/a.wbt") == key);
    BOOST_TEST(core::picture_key("https://github.com/o/r/blob/main/worlds/b.wbt") != key);
    std::vector<std::string> const keys{core::picture_key(found[2].url), key};
    auto const answer = core::world_list_json(found, keys);
    BOOST_TEST(core::parse_picture_keys(answer) == keys, boost::test_tools::per_element());
    BOOST_TEST((core::parse_world_list(answer) == found));
    BOOST_TEST(
        core::gallery_json(std::span(found).subspan(2), keys) ==
        concat(R"({"worlds":[{"url":")", found[2].url, R"(","picture":"picture/)", keys[0], R"("}]})"));
    BOOST_TEST(core::gallery_json(std::span(found).first(1), keys).find("picture/") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(keys_that_are_none_are_left_out)
{
    for (auto const* list :
         {"", "{}", R"({"pictures":7})",
          R"({"pictures":[7,"","0123456789abcde","../../etc/passwd","0123456789ABCDEF"]})"})
        BOOST_TEST(core::parse_picture_keys(list).empty(), list);
}

BOOST_AUTO_TEST_CASE(a_world_of_which_nothing_is_known_is_called_as_its_file)
{
    BOOST_TEST(core::title_of_address("local:/a/b/worlds/pick_and_place.wbt") == "Pick and place");
    BOOST_TEST(core::title_of_address("local:/a/b/worlds/two%20arms.wbt") == "Two arms");
    BOOST_TEST(core::title_of_address("local:/a/b/worlds/100%.wbt") == "100%");
    BOOST_TEST(core::title_of_address("local:/a/b/worlds/UR5e.wbt") == "UR5e");
}

BOOST_AUTO_TEST_SUITE_END()
