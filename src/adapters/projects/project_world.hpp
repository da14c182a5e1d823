// What every source reads of a project whose files are there: the world, of which it has to make sure, and
// `webots.yml`.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <filesystem>
#include <string>

namespace webots_cloud::adapters {

/// What `fetch` returns of a project with the world file `<root>/worlds/<world>`. Blocks.
///
/// Errors: `not_found`: there is none.
result<FetchedProject> finished_project(std::filesystem::path root, std::string revision,
                                        std::string const& world);

/// The beginning of `webots.yml`, or else `webots.yaml`, in the folder, at most 64 KiB of it; empty where
/// neither is a regular file: links are not followed. Blocks.
std::string read_webots_yml(std::filesystem::path const& root);

} // namespace webots_cloud::adapters
