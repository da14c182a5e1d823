#include "config_keys.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

std::string default_as_json(ConfigKey const& key)
{
    if (key.required || !key.absent.empty())
        return {};
    if (!key.standard.empty())
        return std::string(key.standard);
    return key.value.as_json ? key.value.as_json(key, nullptr) : std::string();
}

std::string_view default_in_words(ConfigKey const& key) noexcept
{
    return key.absent.empty() ? "none" : key.absent;
}

std::string one_of(std::span<std::string_view const> choices)
{
    std::string text = "one of";
    for (auto const choice : choices)
        text += concat(choice == choices.front() ? " \"" : ", \"", choice, "\"");
    return text;
}

ConfigKey const* find_key(std::span<ConfigTopic const> topics, std::string_view name) noexcept
{
    for (auto const& topic : topics)
        for (auto const& key : topic.keys)
            if (key.name == name || (!key.alias.empty() && key.alias == name))
                return &key;
    return nullptr;
}

std::vector<std::string_view> key_names(std::span<ConfigTopic const> topics)
{
    std::vector<std::string_view> names;
    for (auto const& topic : topics)
        for (auto const& key : topic.keys) {
            names.push_back(key.name);
            if (!key.alias.empty())
                names.push_back(key.alias);
        }
    return names;
}

} // namespace webots_cloud::core
