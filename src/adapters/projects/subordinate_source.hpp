// Projects and files of simulations that run as users of a user namespace.
#pragma once

#include "adapters/process/subordinate_users.hpp"

#include <webots_cloud/transport/project_source.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <filesystem>
#include <memory>

namespace webots_cloud::adapters {

/// `source`, for projects whose folders belong to such users while a simulation runs. `scratch` is an
/// existing folder of the server's.
///
/// Lifetime: `source` must outlive the object.
std::unique_ptr<ProjectSource> for_subordinate_users(ProjectSource& source,
                                                     std::shared_ptr<SubordinateUsers> users,
                                                     std::filesystem::path scratch);

/// `files`, for such folders: what is written gets there by way of `scratch`.
///
/// Lifetime: `files` must outlive the object.
std::unique_ptr<TextFiles> for_subordinate_users(TextFiles& files, std::shared_ptr<SubordinateUsers> users,
                                                 std::filesystem::path scratch);

} // namespace webots_cloud::adapters
