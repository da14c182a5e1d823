// Every key of the configurations, described once: what the reader accepts, which member keeps the value,
// what SIGHUP does, `--help KEY`, the JSON Schemas in config/ and docs/configuration.md all come from here.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

class ConfigReader;
struct ConfigKey;

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

/// How the value of a key is kept: `member` and the like in key_value.hpp make it of a pointer to a member.
/// All functions take the struct that has the member.
struct KeyValue
{
    KeyType type = KeyType::text;
    /// Which struct has the member: the address of its `owner_tag`. Null: no member keeps the value.
    void const* owner = nullptr;
    /// Reads the value. Null: the value has a shape of its own, and the parser of the configuration reads it.
    void (*read)(ConfigReader& reader, ConfigKey const& key, void* owner) = nullptr;
    bool (*equal)(void const* left, void const* right) = nullptr;
    void (*copy)(void const* from, void* to) = nullptr;
    /// The value as JSON; of a new struct where `owner` is null. Empty where it is nothing, as no text or no
    /// path. Null: as empty.
    std::string (*as_json)(ConfigKey const& key, void const* owner) = nullptr;
};

/// Tells structs that keep values from each other.
template<class Owner>
inline constexpr char owner_tag = 0;

/// A key of a configuration. All texts are Markdown, with links relative to the root of the tree.
struct ConfigKey
{
    std::string_view name = {};
    KeyValue value = {};
    std::string_view text = {}; ///< What it is for, without a full stop.
    /// The default as JSON, where a file without the key means something else than a new struct.
    std::string_view standard = {};
    /// What holds without the key, in words, where its default says nothing to people.
    std::string_view absent = {};
    /// Of a number, as in "seconds". Durations, and bytes of which people write megabytes, are kept
    /// converted.
    std::string_view unit = {};
    double min = 0; ///< Of a number.
    double max = 0;
    double least = 0; ///< A number is 0 or at least so much; 0: there is no such gap.
    std::span<std::string_view const> choices = {};
    bool required = false;
    bool reloaded = false;       ///< SIGHUP applies it; else it takes effect at the next start.
    std::string_view alias = {}; ///< An older name of the same key.
    std::span<ConfigKey const> keys = {};
};

/// The default as JSON; empty when `default_in_words` has to say what holds without the key.
std::string default_as_json(ConfigKey const& key);
std::string_view default_in_words(ConfigKey const& key) noexcept;

/// `one of "a", "b"`, as messages say it.
std::string one_of(std::span<std::string_view const> choices);

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
