// Deletes directories that simulations have written into.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>

namespace webots_cloud::adapters {

/// Removes `directory` and everything in it, never following a symbolic link. What is mounted inside is
/// unmounted, not removed. Nothing there: success. Blocks.   Errors: `unavailable`.
result<> remove_tree(std::filesystem::path const& directory);

} // namespace webots_cloud::adapters
