// Pointers of Git LFS: what git stores instead of a large file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

constexpr std::size_t max_lfs_pointer_length = 1024;
constexpr std::size_t shortest_lfs_pointer = 100; ///< Its SHA-256 and the words around it are longer.

/// The digest of a file of no bytes, which servers need not have.
constexpr std::string_view empty_lfs_object =
    "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855";

struct LfsPointer
{
    std::string object;     ///< SHA-256 of the content: 64 lower-case hexadecimal digits.
    std::uint64_t size = 0; ///< Of the content.
    bool extended = false;  ///< The content has to pass through programs that the pointer names.
};

/// Parses what git-lfs accepts as a pointer; numbers only in their canonical form. Nothing for any other
/// file.
std::optional<LfsPointer> parse_lfs_pointer(std::string_view text);

} // namespace webots_cloud::core
