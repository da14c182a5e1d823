// Projects as overlay mounts: the cache below, what a simulation writes above it.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>

namespace webots_cloud::adapters {

/// Mounts `lower` at the open, empty folder `target` so that writes go to `<scratch>/upper`. Needs privileges
/// that only some servers have: see `can_overlay`. `unmount_below` removes it, also after a crash of
/// the process that mounted it.
///
/// Errors: `unavailable`.
result<> mount_overlay(int lower, std::filesystem::path const& scratch, int target);

/// Tests it: mounts a folder of `cache` in `instances`, writes, and checks that the cache has not
/// changed.
bool can_overlay(std::filesystem::path const& cache, std::filesystem::path const& instances);

} // namespace webots_cloud::adapters
