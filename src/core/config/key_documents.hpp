// What people and editors are told of the keys of a configuration.
#pragma once

#include "config_keys.hpp"

#include <span>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// A JSON Schema (draft 7), which says of each key, too, what that has no words for: `x-topic`, `x-unit`,
/// `x-default` (in words), `x-aliasOf` and `x-reloaded`. docs/configuration.md is made from it.
///
/// `server` is `session` or `simulation`.
std::string json_schema(std::string_view server, std::span<ConfigTopic const> topics);

/// What people read of a key, as plain text; sentences end with a full stop.
struct KeyFacts
{
    std::string purpose;
    std::string value;       ///< As in "an integer from 1 to 65535".
    std::string standard;    ///< What holds without the key.
    std::string_view effect; ///< When a change takes effect.
};

KeyFacts facts_of(ConfigKey const& key);

/// What `--help KEY` prints, lines of at most 79 characters. Of an unknown key it says so, and names the most
/// similar one; `is_known` says which.
std::string key_page(std::string_view name, std::span<ConfigTopic const> topics, bool& is_known);

} // namespace webots_cloud::core
