#include "unit_test.hpp"

#include "core/config/config_keys.hpp"
#include "core/config/config_reader.hpp"
#include "core/text.hpp"

#include <boost/json/parse.hpp>

#include <webots_cloud/config.hpp>

#include <set>

using namespace webots_cloud;
using namespace core;

BOOST_AUTO_TEST_SUITE(config_keys)

namespace {

constexpr ConfigKey two_keys[] = {
    {.name = "number", .type = KeyType::number, .text = "a number", .min = 1, .max = 2},
    {.name = "text", .text = "a text", .alias = "oldText"},
};
constexpr ConfigTopic two_topics[] = {{"Topic", two_keys}};

/// A configuration with this key alone.
template<class Parse>
void check_default(Parse parse, ConfigKey const& key, std::string_view others)
{
    if (key.standard.empty())
        return;
    auto const text = concat("{", others, "\"", key.name, "\": ", key.standard, "}");
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
                bool const is_number = key.type == KeyType::number || key.type == KeyType::integer;
                BOOST_TEST(is_number == (key.max > key.min), key.name);
                BOOST_TEST((key.type == KeyType::choice) == !key.choices.empty(), key.name);
                bool const has_keys = key.type == KeyType::objects || key.type == KeyType::object ||
                                      key.type == KeyType::object_list;
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
    BOOST_CHECK_THROW(reader.read_number("other", number), std::logic_error);
    BOOST_CHECK_THROW(reader.read_number("text", number), std::logic_error);
    reader.read_number("number", number);
    reader.read("text", text);
    BOOST_CHECK_THROW(reader.warnings(), std::logic_error); // nobody has read "oldText"
    reader.read("oldText", text);
    BOOST_TEST(reader.warnings().empty());
    BOOST_TEST(number == 1.5);
}

BOOST_AUTO_TEST_CASE(numbers_are_written_as_people_do)
{
    BOOST_TEST(number_text(0.1) == "0.1");
    BOOST_TEST(number_text(1e12) == "1000000000000");
    BOOST_TEST(number_text(-3) == "-3");
    BOOST_TEST(number_text(0.001) == "0.001");
}

BOOST_AUTO_TEST_SUITE_END()
