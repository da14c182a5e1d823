// What simulations leave behind in docker, and which of it may be removed (protocol section 6.5).
#pragma once

#include <webots_cloud/time.hpp>

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The name by which a server recognises its containers, whatever else runs on the machine:
/// `webots-2000-1f3a9c4d`.
///
/// Unique: two running servers differ in machine, port or folder.
std::string docker_identity(std::string_view machine, std::uint16_t port,
                            std::filesystem::path const& instances);

/// Whose things are removed.
struct DockerScope
{
    DockerScope() = default;

    std::string identity; ///< The server's.
    std::string project;  ///< One simulation's; empty: all of the server's, which has just been started.
};

/// The format for `docker <kind> ls --format`. Labels are requested as JSON:
/// anybody can put a line end into one, and what follows it would look like a line of another container.
inline constexpr std::string_view container_format =
    "{{.ID}}\t{{json (.Label \"com.docker.compose.project\")}}\t"
    "{{json (.Label \"webots_cloud.server\")}}\t{{.Status}}";
inline constexpr std::string_view network_format =
    "{{.ID}}\t{{json (.Label \"com.docker.compose.project\")}}";
inline constexpr std::string_view volume_format =
    "{{.Name}}\t{{json (.Label \"com.docker.compose.project\")}}";
inline constexpr std::string_view image_format = "{{.Repository}}:{{.Tag}}\t{{.CreatedAt}}";

/// The containers, networks or volumes of a listing that belong to the scope, and containers in which a build
/// of this server has failed.
std::vector<std::string> leftovers(std::string_view listing, DockerScope const& scope);

/// The containers of a listing that are steps of this server's builds and not started. Docker starts them at
/// once, unless its client disconnects in that moment: then they stay.
std::vector<std::string> unstarted_builds(std::string_view listing, std::string_view identity);

/// Which images may be removed.
struct ImagePolicy
{
    ImagePolicy() = default;

    std::string identity;                ///< Images that were built for this server's simulations.
    std::string repository;              ///< Of the default images.
    std::vector<std::string> persistent; ///< `repository:tag` that stay.
    std::set<std::string> projects;      ///< Simulations whose images stay, because they live.
};

/// The images of a listing that are ours and older than 48 hours; a container may still use them.
std::vector<std::string> old_images(std::string_view listing, ImagePolicy const& policy, WallTime now);

} // namespace webots_cloud::core
