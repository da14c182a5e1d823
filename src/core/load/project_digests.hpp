// Keys of projects as text, in reports.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Base64url without padding (RFC 4648, section 5), each key with its highest byte first.
std::string write_digests(std::vector<std::uint32_t> const& digests);

/// Appends what is in `text`; false when it is no such text, or is of more than `max` digests.
bool read_digests(std::string_view text, std::size_t max, std::vector<std::uint32_t>& digests);

} // namespace webots_cloud::core
