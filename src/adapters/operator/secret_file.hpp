// Files with one secret word each, which only their owner may read, or root's, which the group of the server
// may read.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// The word in a file; `what` it is, for messages: "the operator's token".
///
/// Errors: `invalid_config`: the file can't be read, others may read it too, or there is no single word of at
/// least 16 characters in it.
result<std::string> read_secret(std::filesystem::path const& file, std::string_view what);

/// The teachers' password, the only line of `file`.
///
/// Errors: `invalid_config`: the file can't be read, others may read it too, or the password is shorter than
/// 8 characters.
result<std::string> read_password(std::filesystem::path const& file);

} // namespace webots_cloud::adapters
