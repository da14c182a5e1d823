// What simulations leave behind in Docker, and which of it may be removed (protocol section 6.5).
#pragma once

#include <webots_cloud/time.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// The name by which a server recognises its containers, whatever else runs on the machine:
/// `webots-2000-1f3a9c4d`.
///
/// Unique: two running servers differ in machine, port or folder.
std::string docker_identity(std::string_view machine, std::uint16_t port,
                            std::filesystem::path const& instances);

/// Whose containers, networks and volumes are meant.
struct DockerScope
{
    DockerScope() = default;

    std::string identity; ///< The server's.
    std::string project;  ///< One simulation's; empty: those of all simulations of the server.
};

/// Those objects of a listing that belong to the scope.
using LeftoverFilter = std::vector<std::string> (*)(std::string_view listing, DockerScope const& scope);

/// A kind of object that simulations leave behind: the arguments of docker that list and that remove it.
struct LeftoverKind
{
    LeftoverKind() = default;
    LeftoverKind(std::vector<std::string> list, LeftoverFilter found, std::vector<std::string> remove)
        : list(std::move(list)), found(found), remove(std::move(remove))
    {}

    std::vector<std::string> list;
    LeftoverFilter found = nullptr;
    std::vector<std::string> remove; ///< The names of the objects follow.
};

/// In the order of their removal: networks, volumes and images can't be removed while a container uses them.
/// Of an image its name goes, and its last step; the others stay, for the next build.
std::vector<LeftoverKind> leftover_kinds();

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
inline constexpr std::string_view build_format = "{{.ID}}\t{{.CreatedAt}}";

/// The containers, networks or volumes of a listing that belong to the scope, and containers in which a build
/// of this server has failed.
std::vector<std::string> leftovers(std::string_view listing, DockerScope const& scope);

/// The images of a listing that were built for the scope.
std::vector<std::string> named_images(std::string_view listing, DockerScope const& scope);

/// The containers of a listing that are steps of this server's builds and not started. Docker starts them at
/// once, unless its client disconnects at that moment: then they stay.
std::vector<std::string> unstarted_builds(std::string_view listing, std::string_view identity);

/// Finds out which unstarted builds nobody waits for any more. When compose is killed in the middle of a
/// build, docker may still create the container of the next step; that of a build that goes on has been
/// started by the next look.
class BuildWatch
{
public:
    /// Docker creates the next step of a build within this time, however busy the machine is.
    static constexpr auto interval = std::chrono::seconds(10);

    /// Whether to look once more: until nothing was found twice in a row, and not for ever.
    bool goes_on() const noexcept;

    /// `unstarted` was found.   Returns: what was there at the look before too, and is to be removed.
    std::vector<std::string> look(std::vector<std::string> unstarted);

private:
    std::vector<std::string> before_;
    int looks_ = 0;
    int empty_in_a_row_ = 0;
};

/// Which images may be removed.
struct ImagePolicy
{
    ImagePolicy() = default;

    std::string repository;              ///< Of the default images.
    std::vector<std::string> persistent; ///< `repository:tag` that stay.
};

/// The default images of a listing that are older than 48 hours; a container may still use them.
std::vector<std::string> old_images(std::string_view listing, ImagePolicy const& policy, WallTime now);

/// The arguments of docker that list, in `build_format`, what is kept of the builds of this server: images
/// without a name.
std::vector<std::string> list_builds(std::string_view identity);

/// The images of such a listing that are older than 48 hours; a container may still use them.
std::vector<std::string> old_builds(std::string_view listing, WallTime now);

} // namespace webots_cloud::core
