// What every source reads of a fetched project: the world, of which it has to make sure, and `webots.yml`.
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

/// The beginning of `webots.yml`, or else `webots.yaml`, in the folder, at most 64 KiB of it; empty where
/// neither is a regular file: links are not followed. Blocks.
std::string read_webots_yml(std::filesystem::path const& root);

} // namespace webots_cloud::adapters
