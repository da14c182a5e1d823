// The end of a zip file, which has the position and length of its list of entries.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace webots_cloud::core {

/// How many bytes at the end of a zip file hold what `check_zip_directory` looks for, a comment and the
/// records of zip64 included.
inline constexpr std::size_t zip_tail = 56 + 20 + 22 + 65535;

/// Checks that the list of entries is small enough for memory: libarchive reads all of it before it returns
/// the first entry.
///
/// `tail`: the last `zip_tail` bytes of the file, or all of it; `size`: of the file.
/// Errors: `protocol_error` (no zip), `too_large` (more than `max_entries`, or a list too long for them);
/// the detail is a sentence.
result<> check_zip_directory(std::string_view tail, std::uint64_t size, std::uint32_t max_entries);

} // namespace webots_cloud::core
