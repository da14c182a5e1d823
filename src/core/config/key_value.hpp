// Binds the key of a configuration to the member of a struct that keeps its value: from the member's type
// follow how the value is read, what its default is, and whether two configurations differ in it.
#pragma once

#include "config_keys.hpp"

#include <webots_cloud/time.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace webots_cloud::core {

// Each leaves `value` alone when the key is absent. Of a choice that is kept as `bool`, the second one is
// true. Durations are kept of keys with the unit seconds or days; bytes of megabytes or gigabytes.
void read_value(ConfigReader& reader, ConfigKey const& key, bool& value);
void read_value(ConfigReader& reader, ConfigKey const& key, int& value);
void read_value(ConfigReader& reader, ConfigKey const& key, std::uint16_t& value);
void read_value(ConfigReader& reader, ConfigKey const& key, std::uint64_t& value);
void read_value(ConfigReader& reader, ConfigKey const& key, double& value);
void read_value(ConfigReader& reader, ConfigKey const& key, Duration& value);
void read_value(ConfigReader& reader, ConfigKey const& key, std::string& value);
void read_value(ConfigReader& reader, ConfigKey const& key, std::filesystem::path& value);
void read_value(ConfigReader& reader, ConfigKey const& key, std::vector<std::string>& value);
/// Text that is only ever shown, or that is checked more strictly later.
void read_any_text(ConfigReader& reader, ConfigKey const& key, std::string& value);
/// Whatever it is.
void ignore_value(ConfigReader& reader, ConfigKey const& key);
/// Whether the file has the key, by either of its names.
bool has_value(ConfigReader const& reader, ConfigKey const& key);

/// Stays empty when the key is absent.
template<class Value>
void read_value(ConfigReader& reader, ConfigKey const& key, std::optional<Value>& value)
{
    Value found{};
    read_value(reader, key, found);
    if (has_value(reader, key))
        value = std::move(found);
}

// Values as JSON; empty for what is nothing.
std::string value_text(ConfigKey const& key, bool value);
std::string value_text(ConfigKey const& key, int value);
std::string value_text(ConfigKey const& key, std::uint64_t value);
std::string value_text(ConfigKey const& key, double value);
std::string value_text(ConfigKey const& key, Duration value);
std::string value_text(ConfigKey const& key, std::string const& value);
std::string value_text(ConfigKey const& key, std::filesystem::path const& value);
std::string value_text(ConfigKey const& key, std::vector<std::string> const& value);

inline std::string value_text(ConfigKey const& key, std::uint16_t value)
{
    return value_text(key, int{value});
}

template<class Value>
std::string value_text(ConfigKey const& key, std::optional<Value> const& value)
{
    return value ? value_text(key, *value) : std::string();
}

template<class Value>
inline constexpr bool is_optional = false;
template<class Value>
inline constexpr bool is_optional<std::optional<Value>> = true;

/// The type of a key whose value has this C++ type.
template<class Value>
constexpr KeyType type_of()
{
    if constexpr (is_optional<Value>)
        return type_of<typename Value::value_type>();
    else if constexpr (std::is_same_v<Value, bool>)
        return KeyType::boolean;
    else if constexpr (std::is_same_v<Value, int> || std::is_same_v<Value, std::uint16_t>)
        return KeyType::integer;
    else if constexpr (std::is_same_v<Value, std::string>)
        return KeyType::text;
    else if constexpr (std::is_same_v<Value, std::filesystem::path>)
        return KeyType::path;
    else if constexpr (std::is_same_v<Value, std::vector<std::string>>)
        return KeyType::texts;
    else
        return KeyType::number;
}

/// The way from a struct to a member, or to a member of a member.
template<auto first, auto... rest>
struct MemberPath
{
    template<class Struct, class Member>
    static Struct struct_of(Member Struct::*);

    using Owner = decltype(struct_of(first));

    static auto const& in(void const* owner)
    {
        return ((static_cast<Owner const*>(owner)->*first).*....*rest);
    }
    static auto& in(void* owner) { return ((static_cast<Owner*>(owner)->*first).*....*rest); }

    using Value = std::remove_cvref_t<decltype(in(static_cast<void*>(nullptr)))>;
};

/// Kept in a member, but read by the parser of the configuration, since its shape is its own.
template<KeyType key_type, auto... path>
inline constexpr KeyValue shaped{
    .type = key_type,
    .owner = &owner_tag<typename MemberPath<path...>::Owner>,
    .equal =
        [](void const* left, void const* right) {
            return MemberPath<path...>::in(left) == MemberPath<path...>::in(right);
        },
    .copy = [](void const* from, void* to) { MemberPath<path...>::in(to) = MemberPath<path...>::in(from); }};

template<KeyType key_type, auto... path>
inline constexpr KeyValue typed{
    .type = key_type,
    .owner = shaped<key_type, path...>.owner,
    .read = [](ConfigReader& reader, ConfigKey const& key,
               void* owner) { read_value(reader, key, MemberPath<path...>::in(owner)); },
    .equal = shaped<key_type, path...>.equal,
    .copy = shaped<key_type, path...>.copy,
    .as_json =
        [](ConfigKey const& key, void const* owner) {
            typename MemberPath<path...>::Owner const made{};
            return value_text(key, MemberPath<path...>::in(owner ? owner : &made));
        }};

/// Kept in a member whose type says that of the key.
template<auto... path>
inline constexpr KeyValue member = typed<type_of<typename MemberPath<path...>::Value>(), path...>;

/// A string, with control characters too: see `read_any_text`.
template<auto... path>
inline constexpr KeyValue free_text{
    .type = KeyType::text,
    .owner = member<path...>.owner,
    .read = [](ConfigReader& reader, ConfigKey const& key,
               void* owner) { read_any_text(reader, key, MemberPath<path...>::in(owner)); },
    .equal = member<path...>.equal,
    .copy = member<path...>.copy,
    .as_json = member<path...>.as_json};

/// Accepted, and kept nowhere.
inline constexpr KeyValue ignored_text{.type = KeyType::text,
                                       .read = [](ConfigReader& reader, ConfigKey const& key, void*) {
                                           std::string ignored;
                                           read_any_text(reader, key, ignored);
                                       }};
inline constexpr KeyValue unused{
    .type = KeyType::unused,
    .read = [](ConfigReader& reader, ConfigKey const& key, void*) { ignore_value(reader, key); }};

template<auto... path>
inline constexpr KeyValue secret = typed<KeyType::secret, path...>;

template<auto... path>
inline constexpr KeyValue choice = typed<KeyType::choice, path...>;

} // namespace webots_cloud::core
