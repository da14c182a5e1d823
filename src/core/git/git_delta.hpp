// git's deltas: an object as copies out of another one and new bytes.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// How large the object is that `delta` makes.   Errors: `malformed`.
result<std::uint64_t> delta_result_size(std::string_view delta);

/// The object that `delta` makes out of `base`; never larger than `delta_result_size` says.   Errors:
/// `protocol_error`.
result<std::string> apply_delta(std::string_view base, std::string_view delta);

} // namespace webots_cloud::core
