#include "unit_test.hpp"

#include "core/config/config_keys.hpp"
#include "core/config/config_reader.hpp"
#include "core/config/key_value.hpp"
#include "core/text.hpp"

#include <boost/json/parse.hpp>

#include <webots_cloud/config.hpp>

#include <set>

using namespace webots_cloud;
using namespace core;

BOOST_AUTO_TEST_SUITE(config_keys)

namespace {

struct Two
{
    double number = 1;
    std::string text;
};

constexpr ConfigKey two_keys[] = {
    {.name = "number", .value = member<&Two::number>, .text = "a number", .min = 1, .max = 2},
    {.name = "text", .value = member<&Two::text>, .text = "a text", .alias = "oldText"},
};
constexpr ConfigTopic two_topics[] = {{"Topic", two_keys}};

/// A configuration with this key alone.
template<class Parse>
void check_default(Parse parse, ConfigKey const& key, std::string_view others)
{
    auto const standard = default_as_json(key);
    if (standard.empty())
        return;
    auto const text = concat("{", others, "\"", key.name, "\": ", standard, "}");
    BOOST_TEST(parse(text, "c.json").has_value(), text);
}

} // namespace

BOOST_AUTO_TEST_CASE(each_key_is_described_once_and_whole)
{
    for (auto const topics : {session_topics(), simulation_topics()}) {
        std::set<std::string_view> names;
        for (auto const name : key_names(topics))
            BOOST_TEST(names.insert(name).second, name << " is there twice");
        BOOST_TEST(names.size() > 40u);
        for (auto const& topic : topics)
            for (auto const& key : topic.keys) {
                BOOST_TEST(!key.text.empty(), key.name);
                BOOST_TEST(!key.text.ends_with('.'), key.name);
                bool const is_number =
                    key.value.type == KeyType::number || key.value.type == KeyType::integer;
                BOOST_TEST(is_number == (key.max > key.min), key.name);
                BOOST_TEST((key.value.type == KeyType::choice) == !key.choices.empty(), key.name);
                bool const has_keys = key.value.type == KeyType::objects ||
                                      key.value.type == KeyType::object ||
                                      key.value.type == KeyType::object_list;
                BOOST_TEST(has_keys == !key.keys.empty(), key.name);
                BOOST_TEST(find_key(topics, key.name) == &key);
            }
    }
    BOOST_TEST(find_key(simulation_topics(), "fullyQualifiedDomainName")->name == "server");
    BOOST_TEST(find_key(session_topics(), "") == nullptr);
}

BOOST_AUTO_TEST_CASE(defaults_are_json_that_the_reader_takes)
{
    for (auto const& topic : session_topics())
        for (auto const& key : topic.keys)
            check_default(parse_session_config, key,
                          key.name == "port" ? "" : R"("port":1,"simulationServers":[],)");
    for (auto const& topic : simulation_topics())
        for (auto const& key : topic.keys)
            check_default(parse_simulation_config, key, R"("server":"h",)");
}

BOOST_AUTO_TEST_CASE(who_asks_for_what_the_table_lacks_or_for_another_type_is_wrong)
{
    auto reader = ConfigReader::parse(R"({"number":1.5,"text":"x"})", "c.json", two_topics).value();
    double number = 0;
    std::string text;
    SessionConfig other;
    BOOST_CHECK_THROW(reader.read_number("other", number), std::logic_error);
    BOOST_CHECK_THROW(reader.read_number("text", number), std::logic_error);
    BOOST_CHECK_THROW(reader.read_members(other), std::logic_error); // it has no such members
    reader.read_number("number", number);
    reader.read("text", text);
    BOOST_CHECK_THROW(reader.warnings(), std::logic_error); // nobody has read "oldText"
    Two two;
    reader.read_members(two);
    BOOST_TEST(reader.warnings().empty());
    BOOST_TEST(two.number == 1.5);
    BOOST_TEST(two.text == "x");
}

BOOST_AUTO_TEST_CASE(an_older_name_is_read_and_the_newer_one_counts)
{
    for (auto const& [text, expected] :
         {std::pair(R"({"oldText":"old"})", "old"), {R"({"oldText":"old","text":"new"})", "new"}}) {
        auto reader = ConfigReader::parse(text, "c.json", two_topics).value();
        Two two;
        reader.read_members(two);
        BOOST_TEST(two.text == expected);
        BOOST_TEST(default_as_json(two_keys[0]) == "1");
        BOOST_TEST(default_as_json(two_keys[1]).empty());
    }
}

BOOST_AUTO_TEST_CASE(numbers_are_written_as_people_do)
{
    BOOST_TEST(number_text(0.1) == "0.1");
    BOOST_TEST(number_text(1e12) == "1000000000000");
    BOOST_TEST(number_text(-3) == "-3");
    BOOST_TEST(number_text(0.001) == "0.001");
}

BOOST_AUTO_TEST_SUITE_END()
