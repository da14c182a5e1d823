// The tables of keys as documents: the JSON Schema that editors use, from which docs/configuration.md is
// made, the page that --help KEY prints, and what src/manual makes pages of. No fact about a key is written
// here.
#include "key_documents.hpp"

#include "config_reader.hpp"
#include "core/text.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <cmath>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

json::object schema_of_keys(std::span<ConfigKey const> keys);

json::value number_value(double number)
{
    return number == std::floor(number) ? json::value(static_cast<std::int64_t>(number))
                                        : json::value(number);
}

json::object range(double min, double max)
{
    return {{"minimum", number_value(min)}, {"maximum", number_value(max)}};
}

/// What the schema says of the type of a key.
json::object type_of(ConfigKey const& key)
{
    json::object const strings{{"type", "array"}, {"items", {{"type", "string"}}}};
    switch (key.value.type) {
    case KeyType::boolean:
        return {{"type", "boolean"}};
    case KeyType::integer:
    case KeyType::number: {
        json::object schema{{"type", key.value.type == KeyType::integer ? "integer" : "number"}};
        if (key.least > 0)
            schema["anyOf"] = json::array{json::object{{"const", 0}}, range(key.least, key.max)};
        else
            for (auto const& [name, limit] : range(key.min, key.max))
                schema[name] = limit;
        return schema;
    }
    case KeyType::text:
    case KeyType::secret:
        return {{"type", "string"}};
    case KeyType::path:
        return {{"type", "string"}, {"minLength", 1}};
    case KeyType::choice: {
        json::array choices;
        for (auto const choice : key.choices)
            choices.emplace_back(choice);
        return {{"enum", std::move(choices)}};
    }
    case KeyType::texts:
        return strings;
    case KeyType::text_or_list:
        return {{"anyOf", json::array{json::object{{"type", "string"}}, strings}}};
    case KeyType::object:
        return schema_of_keys(key.keys);
    case KeyType::object_list:
        return {{"type", "array"}, {"items", schema_of_keys(key.keys)}};
    case KeyType::objects:
        return {
            {"type", "array"},
            {"items", {{"anyOf", json::array{json::object{{"type", "string"}}, schema_of_keys(key.keys)}}}}};
    case KeyType::unused:
        break;
    }
    return {};
}

json::object schema_of(ConfigKey const& key)
{
    json::object schema = type_of(key);
    schema["description"] = key.text;
    if (auto const standard = default_as_json(key); !standard.empty())
        schema["default"] = json::parse(standard);
    else if (!key.required)
        schema["x-default"] = default_in_words(key);
    if (!key.unit.empty())
        schema["x-unit"] = key.unit;
    schema["x-reloaded"] = key.reloaded;
    return schema;
}

json::object schema_of_keys(std::span<ConfigKey const> keys)
{
    json::object properties;
    json::array required;
    for (auto const& key : keys) {
        properties[key.name] = schema_of(key);
        if (key.required)
            required.emplace_back(key.name);
    }
    return {{"type", "object"}, {"properties", std::move(properties)}, {"required", std::move(required)}};
}

void print(json::value const& value, std::string const& indent, std::string& text)
{
    auto const more = indent + "  ";
    if (auto const* object = value.if_object(); object && !object->empty()) {
        text += "{";
        for (auto const& [name, member] : *object) {
            text += concat(&member == &object->begin()->value() ? "\n" : ",\n", more,
                           json::serialize(json::string(name)), ": ");
            print(member, more, text);
        }
        text += concat("\n", indent, "}");
    } else if (auto const* list = value.if_array(); list && !list->empty()) {
        text += "[";
        for (auto const& entry : *list) {
            text += concat(&entry == &list->front() ? "\n" : ",\n", more);
            print(entry, more, text);
        }
        text += concat("\n", indent, "]");
    } else {
        text += value.is_double() ? number_text(value.get_double()) : json::serialize(value);
    }
}

/// Markdown as plain text: `[words](docs/page.md)` becomes `words (docs/page.md)`.
std::string plain(std::string_view markdown)
{
    std::string text;
    while (!markdown.empty()) {
        auto const open = markdown.find('[');
        auto const middle = markdown.find("](", open);
        auto const close = markdown.find(')', middle);
        if (close == std::string_view::npos)
            break;
        auto const words = markdown.substr(open + 1, middle - open - 1);
        auto const target = markdown.substr(middle + 2, close - middle - 2);
        if (words.find('[') != std::string_view::npos) { // that bracket begins no link
            text += markdown.substr(0, open + 1);
            markdown.remove_prefix(open + 1);
            continue;
        }
        text += markdown.substr(0, open);
        text += target.starts_with(words) ? std::string(target) : concat(words, " (", target, ")");
        markdown.remove_prefix(close + 1);
    }
    text += markdown;
    std::erase(text, '`');
    return text;
}

void wrap(std::string& page, std::string_view text, std::string_view indent)
{
    constexpr std::size_t width = 79;
    std::size_t column = width;
    for (auto const word : split(text, ' ')) {
        if (column + 1 + word.size() > width) {
            page += concat(page.empty() ? "" : "\n", indent, word);
            column = indent.size() + word.size();
        } else {
            page += concat(" ", word);
            column += 1 + word.size();
        }
    }
}

std::string names_of(std::span<ConfigKey const> keys)
{
    std::string names;
    for (auto const& key : keys)
        names += concat(" \"", key.name, "\"");
    return names;
}

std::string type_text(ConfigKey const& key)
{
    auto const unit = key.unit.empty() ? std::string() : concat(" (", key.unit, ")");
    auto const span = concat(
        key.least > 0 ? "0, or " : "", key.value.type == KeyType::integer ? "an integer" : "a number",
        " from ", number_text(key.least > 0 ? key.least : key.min), " to ", number_text(key.max), unit);
    switch (key.value.type) {
    case KeyType::boolean:
        return "true or false";
    case KeyType::integer:
    case KeyType::number:
        return span;
    case KeyType::text:
    case KeyType::secret:
        return "a string";
    case KeyType::path:
        return "a path; ~ and $NAME are replaced from the environment";
    case KeyType::choice: {
        std::string text = "one of";
        for (auto const choice : key.choices)
            text += concat(" \"", choice, "\"");
        return text;
    }
    case KeyType::texts:
        return "a list of strings";
    case KeyType::text_or_list:
        return "a string, or a list of strings";
    case KeyType::object:
        return concat("an object with the keys", names_of(key.keys));
    case KeyType::object_list:
        return concat("a list of objects with the keys", names_of(key.keys));
    case KeyType::objects:
        return concat("a list of strings, or of objects with the keys", names_of(key.keys));
    case KeyType::unused:
        break;
    }
    return "anything";
}

/// A line for each key of an object, followed by those of an object in there.
void wrap_keys(std::string& page, std::span<ConfigKey const> keys, std::string const& indent)
{
    for (auto const& key : keys) {
        wrap(page,
             concat("\"", key.name, "\": ", plain(key.text), "; ", type_text(key),
                    key.required ? ", required." : "."),
             indent);
        wrap_keys(page, key.keys, indent + "  ");
    }
}

} // namespace

std::string json_schema(std::string_view server, std::span<ConfigTopic const> topics)
{
    json::object properties;
    json::array required;
    for (auto const& topic : topics)
        for (auto const& key : topic.keys) {
            auto schema = schema_of(key);
            schema["x-topic"] = topic.title;
            properties[key.name] = schema;
            if (key.required)
                required.emplace_back(key.name);
            if (key.alias.empty())
                continue;
            schema["x-aliasOf"] = key.name;
            schema["deprecated"] = true;
            properties[key.alias] = std::move(schema);
        }
    std::string text;
    print(json::object{{"$schema", "http://json-schema.org/draft-07/schema#"},
                       {"title", concat("Configuration of webots-", server, "-server")},
                       {"type", "object"},
                       {"required", std::move(required)},
                       {"properties", std::move(properties)}},
          "", text);
    return text + "\n";
}

KeyFacts facts_of(ConfigKey const& key)
{
    auto const json = default_as_json(key);
    KeyFacts facts;
    facts.purpose = concat(plain(key.text), ".");
    facts.value = type_text(key);
    facts.standard = key.required   ? std::string("none, the key is required")
                     : json.empty() ? plain(default_in_words(key))
                                    : concat(json, key.unit.empty() ? "" : concat(" ", key.unit));
    facts.effect = key.reloaded ? "SIGHUP applies a change." : "A change takes effect at the next start.";
    return facts;
}

std::string key_page(std::string_view name, std::span<ConfigTopic const> topics, bool& is_known)
{
    auto const* key = find_key(topics, name);
    is_known = key != nullptr;
    if (!key) {
        auto const near = nearest(name, key_names(topics));
        return concat("There is no key \"", printable(name, 60), "\".",
                      near.empty() ? "" : concat(" Did you mean \"", near, "\"?"), "\n");
    }
    auto const facts = facts_of(*key);
    std::string page;
    wrap(page, concat(key->name, key->alias.empty() ? "" : concat(" (older name: ", key->alias, ")")), "");
    wrap(page, facts.purpose, "  ");
    page += "\n";
    wrap(page, concat("Value: ", facts.value, "."), "  ");
    wrap(page, concat("Default: ", facts.standard, "."), "  ");
    wrap(page, facts.effect, "  ");
    page += "\n";
    wrap_keys(page, key->keys, "  ");
    return page + (key->keys.empty() ? "" : "\n");
}

} // namespace webots_cloud::core
