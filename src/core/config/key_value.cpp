// How each type of member is read, shown and compared. A key of a new type needs a function here; a new key
// of a known type needs none.
#include "key_value.hpp"

#include "config_reader.hpp"
#include "core/text.hpp"

#include <boost/json/serialize.hpp>

namespace webots_cloud::core {
namespace {

/// How many of what is kept are one of the unit in which people write the number.
double size_of_unit(ConfigKey const& key)
{
    if (key.unit == "days")
        return 24 * 60 * 60; // seconds
    if (key.unit == "megabytes")
        return 1 << 20;
    if (key.unit == "gigabytes")
        return 1 << 30;
    return 1;
}

std::string json_string(std::string_view text)
{
    return boost::json::serialize(boost::json::string(text));
}

/// Calls `read` with each name that files may have for a key; the newer name counts where there are both.
template<class Read>
void read_names(ConfigKey const& key, Read read)
{
    if (!key.alias.empty())
        read(key.alias);
    read(key.name);
}

} // namespace

bool has_value(ConfigReader const& reader, ConfigKey const& key)
{
    return reader.has(key.name) || (!key.alias.empty() && reader.has(key.alias));
}

void read_value(ConfigReader& reader, ConfigKey const& key, bool& value)
{
    if (key.value.type != KeyType::choice)
        return read_names(key, [&](auto name) { reader.read(name, value); });
    std::string chosen(key.choices[value ? 1 : 0]);
    reader.read_choice(key.name, chosen);
    value = chosen == key.choices[1];
}

void read_value(ConfigReader& reader, ConfigKey const& key, int& value)
{
    read_names(key, [&](auto name) { reader.read_integer(name, value); });
}

void read_value(ConfigReader& reader, ConfigKey const& key, std::uint16_t& value)
{
    int number = value;
    read_value(reader, key, number);
    value = static_cast<std::uint16_t>(number);
}

void read_value(ConfigReader& reader, ConfigKey const& key, std::uint64_t& value)
{
    double number = static_cast<double>(value) / size_of_unit(key);
    read_value(reader, key, number);
    if (has_value(reader, key))
        value = static_cast<std::uint64_t>(number * size_of_unit(key));
}

void read_value(ConfigReader& reader, ConfigKey const& key, double& value)
{
    read_names(key, [&](auto name) { reader.read_number(name, value); });
}

void read_value(ConfigReader& reader, ConfigKey const& key, Duration& value)
{
    double number = std::chrono::duration<double>(value).count() / size_of_unit(key);
    read_value(reader, key, number);
    if (has_value(reader, key))
        value =
            std::chrono::duration_cast<Duration>(std::chrono::duration<double>(number * size_of_unit(key)));
}

void read_value(ConfigReader& reader, ConfigKey const& key, std::string& value)
{
    if (key.value.type == KeyType::choice)
        reader.read_choice(key.name, value);
    else
        read_names(key, [&](auto name) { reader.read(name, value); });
}

void ignore_value(ConfigReader& reader, ConfigKey const& key)
{
    (void)reader.find(key.name);
}

void read_any_text(ConfigReader& reader, ConfigKey const& key, std::string& value)
{
    reader.read_text(key.name, value);
}

void read_value(ConfigReader& reader, ConfigKey const& key, std::filesystem::path& value)
{
    read_names(key, [&](auto name) { reader.read(name, value); });
}

void read_value(ConfigReader& reader, ConfigKey const& key, std::vector<std::string>& value)
{
    read_names(key, [&](auto name) { reader.read(name, value); });
}

std::string value_text(ConfigKey const& key, bool value)
{
    if (key.value.type == KeyType::choice)
        return json_string(key.choices[value ? 1 : 0]);
    return value ? "true" : "false";
}

std::string value_text(ConfigKey const&, int value)
{
    return std::to_string(value);
}

std::string value_text(ConfigKey const& key, std::uint64_t value)
{
    return number_text(static_cast<double>(value) / size_of_unit(key));
}

std::string value_text(ConfigKey const&, double value)
{
    return number_text(value);
}

std::string value_text(ConfigKey const& key, Duration value)
{
    return number_text(std::chrono::duration<double>(value).count() / size_of_unit(key));
}

std::string value_text(ConfigKey const&, std::string const& value)
{
    return value.empty() ? std::string() : json_string(value);
}

std::string value_text(ConfigKey const&, std::filesystem::path const& value)
{
    return value.empty() ? std::string() : json_string(value.native());
}

std::string value_text(ConfigKey const&, std::vector<std::string> const& value)
{
    std::string entries;
    for (auto const& entry : value)
        entries += concat(entries.empty() ? "" : ", ", json_string(entry));
    return entries.empty() ? std::string() : concat("[", entries, "]");
}

} // namespace webots_cloud::core
