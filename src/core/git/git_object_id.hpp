// Names of git objects: SHA-1 digests.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The digest that names a commit, a tree or a blob.
struct GitObjectId
{
    std::array<std::uint8_t, 20> bytes{};

    auto operator<=>(GitObjectId const&) const = default;
};

/// 40 lower-case hexadecimal digits.
std::string to_hex(GitObjectId const& id);

/// The digest of exactly 40 hexadecimal digits, else nothing.
std::optional<GitObjectId> git_object_id(std::string_view hex) noexcept;

/// For hash tables: the digest is its own hash.
struct GitObjectIdHash
{
    std::size_t operator()(GitObjectId const& id) const noexcept
    {
        std::size_t value;
        std::memcpy(&value, id.bytes.data(), sizeof value);
        return value;
    }
};

} // namespace webots_cloud::core
