#include "unit_test.hpp"

#include "core/config/config_keys.hpp"
#include "core/config/config_reader.hpp"
#include "core/config/config_reload.hpp"
#include "core/text.hpp"

#include <algorithm>

using namespace webots_cloud;

// The keys of protocol sections 8.1 and 8.2 at SIGHUP, which is ours.
BOOST_AUTO_TEST_SUITE(config_reload)

namespace {

using Keys = std::vector<std::string_view>;

SessionConfig session(std::string_view text)
{
    return parse_session_config(text, "c.json").value().config;
}

SimulationConfig simulation(std::string_view text)
{
    return parse_simulation_config(text, "c.json").value().config;
}

/// A value that the key takes, as JSON, which is not that of a new configuration.
std::string another_value(core::ConfigKey const& key)
{
    auto const standard = key.value.as_json(key, nullptr);
    switch (key.value.type) {
    case core::KeyType::boolean:
        return standard == "true" ? "false" : "true";
    case core::KeyType::integer:
    case core::KeyType::number:
        return core::number_text(key.max);
    case core::KeyType::choice: {
        auto const first = core::concat("\"", key.choices[0], "\"");
        return standard == first ? core::concat("\"", key.choices[1], "\"") : first;
    }
    case core::KeyType::texts:
        return R"(["other"])";
    default:
        return R"("/other")";
    }
}

/// A configuration with this key alone, of which no rule beyond the table knows.
template<class Config>
Config read_alone(std::span<core::ConfigTopic const> topics, core::ConfigKey const& key,
                  std::string const& value)
{
    auto reader =
        core::ConfigReader::parse(core::concat("{\"", key.name, "\":", value, "}"), "c.json", topics);
    Config config;
    reader->read_members(config);
    for (auto const& topic : topics)
        for (auto const& other : topic.keys)
            if (!other.value.read)
                reader->find(other.name);
    BOOST_TEST(!reader->failure(), key.name << ": " << value);
    return config;
}

/// It keeps its value, as it was written, in a member that no other key has, and SIGHUP does with it what the
/// table says.
template<class Config>
void check_key(std::span<core::ConfigTopic const> topics, core::ConfigKey const& key)
{
    auto const value = another_value(key);
    auto const next = read_alone<Config>(topics, key, value);
    BOOST_TEST(key.value.as_json(key, &next) == value, key.name);
    Config running;
    auto const changes = core::take_reloaded(running, next);
    Keys const alone{key.name};
    BOOST_TEST(changes.applied == (key.reloaded ? alone : Keys()), boost::test_tools::per_element());
    BOOST_TEST(changes.waiting == (key.reloaded ? Keys() : alone), boost::test_tools::per_element());
    BOOST_TEST(key.value.equal(&running, &next) == key.reloaded, key.name);
}

/// Values that no such key takes, as JSON.
std::vector<std::string> refused_values(core::ConfigKey const& key)
{
    using core::KeyType;
    std::vector<std::string> values{R"({"no":[1]})", "null"};
    auto const add = [&](std::initializer_list<char const*> more) {
        values.insert(values.end(), more.begin(), more.end());
    };
    switch (key.value.type) {
    case KeyType::boolean:
        add({"1", R"("yes")", "[]"});
        break;
    case KeyType::integer:
        add({"1.5"});
        [[fallthrough]];
    case KeyType::number:
        add({R"("5")", "true", "[]"});
        values.push_back(core::number_text(key.min - 1));
        values.push_back(core::number_text(key.max + 1));
        if (key.least > 0)
            values.push_back(core::number_text(key.least / 2));
        break;
    case KeyType::choice:
        add({R"("no such choice")", "1", "[]"});
        break;
    case KeyType::texts:
        add({R"("a")", "[1]", R"(["\n"])"});
        break;
    case KeyType::path:
        add({R"("\u001b[2J")"});
        [[fallthrough]];
    default:
        add({"5", "[1]"});
    }
    return values;
}

/// Each is refused with the name of the key, in a line that shows no control characters.
template<class Config>
void check_refusals(std::span<core::ConfigTopic const> topics, core::ConfigKey const& key)
{
    for (auto const& value : refused_values(key)) {
        auto const text = core::concat("{\"", key.name, "\":", value, "}");
        auto reader = core::ConfigReader::parse(text, "c.json", topics);
        Config config;
        reader->read_members(config);
        auto const refused = reader->failure();
        BOOST_TEST_REQUIRE(refused.has_value(), text);
        BOOST_TEST(refused->message().starts_with(core::concat(
                       "c.json:1:", std::to_string(key.name.size() + 5), ": key \"", key.name, "\"")),
                   refused->message());
        BOOST_TEST(refused->message().find(": expected ") != std::string::npos, refused->message());
        BOOST_TEST(core::is_printable(refused->message()), text);
    }
}

template<class Config>
int check_each_key(std::span<core::ConfigTopic const> topics)
{
    int checked = 0;
    for (auto const& topic : topics)
        for (auto const& key : topic.keys)
            if (key.value.read && key.value.owner) {
                BOOST_TEST_CONTEXT(key.name)
                {
                    check_key<Config>(topics, key);
                    check_refusals<Config>(topics, key);
                }
                ++checked;
            }
    return checked;
}

Keys sorted(Keys keys)
{
    std::ranges::sort(keys);
    return keys;
}

} // namespace

BOOST_AUTO_TEST_CASE(each_key_is_refused_or_arrives_in_a_member_of_its_own_which_a_reload_applies_or_leaves)
{
    BOOST_TEST(check_each_key<SessionConfig>(core::session_topics()) > 45);
    BOOST_TEST(check_each_key<SimulationConfig>(core::simulation_topics()) > 60);
}

BOOST_AUTO_TEST_CASE(what_may_change_is_copied_and_named_and_the_rest_stays)
{
    auto in_force =
        simulation(R"({"title":"old","maxConnections":8,"simulationsPerAddress":6,"shareIdleTime":20})");
    auto const next = simulation(R"({"title":"new","maxConnections":9,"simulationsPerAddress":6})");
    auto const changes = core::take_reloaded(in_force, next);
    BOOST_TEST(sorted(changes.applied) == (Keys{"shareIdleTime", "title"}), boost::test_tools::per_element());
    BOOST_TEST(changes.waiting == Keys{"maxConnections"}, boost::test_tools::per_element());
    BOOST_TEST(in_force.service.title == "new");
    BOOST_TEST(in_force.service.repositories.share_idle_time == 50);
    BOOST_TEST(in_force.launching.max_simulations == 8);
    BOOST_TEST(core::take_reloaded(in_force, next).applied.empty());
}

BOOST_AUTO_TEST_CASE(values_with_a_shape_of_their_own_are_compared_and_copied_too)
{
    auto listed = session(R"({"port":1,"simulationServers":["a:1"]})");
    auto const others = session(R"({"port":1,"simulationServers":["a:1","b:1"]})");
    auto const changes = core::take_reloaded(listed, others);
    BOOST_TEST(changes.applied == Keys{"simulationServers"}, boost::test_tools::per_element());
    BOOST_TEST(changes.waiting.empty());
    BOOST_TEST(listed.simulation_servers.size() == 2u);

    auto const shown = session(R"({"port":1,"simulationServers":["a:1","b:1"],"worlds":[]})");
    BOOST_TEST(core::take_reloaded(listed, shown).applied == Keys{"worlds"},
               boost::test_tools::per_element());
    BOOST_TEST(listed.service.worlds.has_value());

    auto running = simulation("{}");
    auto const next = simulation(R"({"forges":[],"notify":"https://a","launcher":{"slurm":{}}})");
    BOOST_TEST(sorted(core::take_reloaded(running, next).waiting) == (Keys{"forges", "launcher", "notify"}),
               boost::test_tools::per_element());
    BOOST_TEST(!running.slurm);
}

BOOST_AUTO_TEST_SUITE_END()
