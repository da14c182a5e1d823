// Every key of the configurations, described once: what the reader accepts, `--help KEY`, the JSON Schemas in
// config/ and docs/configuration.md all come from here.
#pragma once

#include <limits>
#include <span>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

enum class KeyType
{
    boolean,
    integer,
    number,       ///< Fractions, too.
    text,         ///< A string.
    secret,       ///< A string that no message quotes.
    path,         ///< Of a file or folder; `~` and `$NAME` are expanded.
    choice,       ///< One of `ConfigKey::choices`.
    texts,        ///< A list of strings.
    text_or_list, ///< A string or a list of strings.
    object,       ///< An object; its keys are `ConfigKey::keys`.
    object_list,  ///< A list of such objects.
    objects,      ///< A list of strings or objects; the keys of the objects are `ConfigKey::keys`.
    unused        ///< Accepted since old files have it, and not used.
};

/// A key of a configuration. All texts are Markdown, with links relative to the root of the tree.
struct ConfigKey
{
    std::string_view name = {};
    KeyType type = KeyType::text;
    std::string_view text = {};     ///< What it is for, without a full stop.
    std::string_view standard = {}; ///< The default as JSON. Empty: `absent` says what holds without the key.
    std::string_view absent = "none";
    std::string_view unit = {}; ///< Of a number, as in "seconds".
    double min = 0;             ///< Of a number.
    double max = 0;
    double least = 0; ///< A number is 0 or at least so much; 0: there is no such gap.
    std::span<std::string_view const> choices = {};
    bool required = false;
    bool reloaded = false;       ///< SIGHUP applies it; else it takes effect at the next start.
    std::string_view alias = {}; ///< An older name of the same key.
    std::span<ConfigKey const> keys = {};
};

/// Keys that are about the same thing, as documents list them.
struct ConfigTopic
{
    std::string_view title;
    std::span<ConfigKey const> keys = {};
};

/// The keys of the two servers. All are constants.
std::span<ConfigTopic const> session_topics() noexcept;
std::span<ConfigTopic const> simulation_topics() noexcept;

/// The key with this name or alias; null when there is none.
ConfigKey const* find_key(std::span<ConfigTopic const> topics, std::string_view name) noexcept;

/// Names and aliases, in the order of the documents.
std::vector<std::string_view> key_names(std::span<ConfigTopic const> topics);

} // namespace webots_cloud::core
