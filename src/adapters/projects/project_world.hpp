// The world of a fetched project, which every source has to make sure of.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// Refuses a project without the world file `<root>/worlds/<world>`; else the first line of that file, at
/// most 256 bytes of it. Blocks.
///
/// Errors: `not_found`, with the message of the Python server.
result<std::string> require_world(std::filesystem::path const& root, std::string const& world);

} // namespace webots_cloud::adapters
