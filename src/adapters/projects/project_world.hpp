// The world of a fetched project: is it there, and what is its first line.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// The first line of `<root>/worlds/<world>`, at most 256 bytes of it. Blocks.
///
/// Errors: `not_found`, with the message of the Python server.
result<std::string> read_world_header(std::filesystem::path const& root, std::string const& world);

} // namespace webots_cloud::adapters
