// Removes until nothing is found any more, since Docker may still be creating what was asked for before.
// Decisions: core/docker/docker_leftovers, core/docker/build_images.
#include "docker_cleanup.hpp"

#include "core/docker/build_images.hpp"
#include "core/text.hpp"

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

using Arguments = std::vector<std::string>;

// Docker may still be creating what a killed compose has asked for.
constexpr int max_rounds = 5;
constexpr auto between_rounds = std::chrono::milliseconds(500);

} // namespace

asio::awaitable<result<>> DockerCleanup::remove_leftovers(std::string project)
{
    core::DockerScope scope;
    scope.identity = facts_.identity;
    scope.project = std::move(project);
    for (int round = 0; round < max_rounds; ++round) {
        if (round > 0)
            (void)co_await clock_.wait_until(clock_.now() + between_rounds);
        auto const found = co_await remove_once(scope);
        if (!found)
            co_return found.error();
        if (*found == 0)
            co_return result<>();
        log_.info(LogCause("left-overs"),
                  concat("docker: removed ", std::to_string(*found), " left-overs of ",
                         scope.project.empty() ? scope.identity : scope.project));
    }
    co_return Failure(errc::unavailable, "docker goes on showing what was removed");
}

asio::awaitable<result<std::size_t>> DockerCleanup::remove_once(core::DockerScope const& scope)
{
    std::size_t total = 0;
    auto kinds = core::leftover_kinds();
    for (auto& kind : kinds) {
        auto const removed = co_await remove_kind(std::move(kind), scope);
        if (!removed)
            co_return removed;
        total += *removed;
    }
    co_return total;
}

asio::awaitable<result<std::size_t>> DockerCleanup::remove_kind(core::LeftoverKind kind,
                                                                core::DockerScope const& scope)
{
    auto const listing = co_await commands_.docker(std::move(kind.list));
    if (!listing)
        co_return listing.error();
    auto const found = kind.found(*listing, scope);
    if (found.empty())
        co_return std::size_t{0};
    auto removal = std::move(kind.remove);
    removal.insert(removal.end(), found.begin(), found.end());
    // This fails for what somebody else removes at the same time, such as the guard of a server that was
    // killed: the next round looks again.
    auto const removed = co_await commands_.docker(std::move(removal));
    if (!removed)
        log_.debug(concat("docker: ", removed.error().message()));
    co_return found.size();
}

asio::awaitable<result<>> DockerCleanup::watch_builds()
{
    core::BuildWatch watch;
    while (watch.goes_on()) {
        auto const waited = co_await clock_.wait_until(clock_.now() + core::BuildWatch::interval);
        if (!waited)
            co_return waited;
        Arguments list{"ps", "--all", "--format", std::string(core::container_format)};
        auto const listing = co_await commands_.docker(std::move(list));
        auto given_up =
            watch.look(core::unstarted_builds(listing ? *listing : std::string(), facts_.identity));
        if (!given_up.empty())
            co_await remove_builds(std::move(given_up));
    }
    co_return result<>();
}

asio::awaitable<void> DockerCleanup::remove_late_names(std::set<std::string> projects)
{
    Arguments list{"images", "--format", std::string(core::image_format)};
    auto const listing = co_await commands_.docker(std::move(list));
    core::DockerScope scope;
    scope.identity = facts_.identity;
    Arguments removal{"rmi", "--force", "--no-prune"};
    auto const options = removal.size();
    for (auto const& project : projects) {
        scope.project = project;
        auto const found = core::named_images(listing ? *listing : std::string(), scope);
        removal.insert(removal.end(), found.begin(), found.end());
    }
    if (removal.size() == options)
        co_return;
    log_.info(LogCause("left-overs"), "docker: removes the names of images whose builds were given up");
    auto const removed = co_await commands_.docker(std::move(removal));
    if (!removed)
        log_.debug(concat("docker: ", removed.error().message()));
}

asio::awaitable<void> DockerCleanup::remove_builds(Arguments containers)
{
    log_.info(LogCause("builds"), concat("docker: removes ", std::to_string(containers.size()),
                                         " containers of builds that were given up"));
    Arguments removal{"rm", "--force", "--volumes"};
    removal.insert(removal.end(), containers.begin(), containers.end());
    auto const removed = co_await commands_.docker(std::move(removal));
    if (!removed)
        log_.debug(concat("docker: ", removed.error().message()));
}

asio::awaitable<void> DockerCleanup::bound_builds(std::set<std::string> in_use)
{
    if (config_.build_cache == 0)
        co_return;
    auto list = core::list_built_ids(facts_.identity);
    auto const listing = co_await commands_.docker(std::move(list));
    auto const ids = core::image_ids(listing ? *listing : std::string());
    if (ids.empty())
        co_return;
    // The list has numbers alone. How large images are, and which is built on which, docker says in a second
    // answer.
    auto describe = core::describe_images(ids);
    auto const description = co_await commands_.docker(std::move(describe));
    auto const images = core::read_images(description ? *description : std::string());
    auto const beyond = core::images_beyond(images, config_.build_cache, in_use);
    if (beyond.empty())
        co_return;
    log_.info(LogCause("build-cache"),
              concat("docker: removes ", std::to_string(beyond.size()),
                     " images of builds, since those that are kept take more than ",
                     std::to_string(config_.build_cache >> 20), " MB (\"buildCache\")"));
    Arguments removal{"rmi", "--no-prune"}; // which would remove what others are built from now
    removal.insert(removal.end(), beyond.begin(), beyond.end());
    auto const removed = co_await commands_.docker(std::move(removal));
    if (!removed) // as those that a container uses, which go next time
        log_.debug(concat("docker: ", removed.error().message()));
}

asio::awaitable<Arguments> DockerCleanup::find_old_images()
{
    Arguments list{"images", "--format", std::string(core::image_format)};
    auto const listing = co_await commands_.docker(std::move(list));
    core::ImagePolicy policy;
    policy.repository = config_.images;
    policy.persistent = *config_.persistent_images;
    auto found = core::old_images(listing ? *listing : std::string(), policy, clock_.wall());
    auto list_builds = core::list_builds(facts_.identity);
    auto const builds = co_await commands_.docker(std::move(list_builds));
    for (auto& build : core::old_builds(builds ? *builds : std::string(), clock_.wall()))
        found.push_back(std::move(build));
    co_return found;
}

asio::awaitable<void> DockerCleanup::remove_old_images()
{
    if (!config_.persistent_images)
        co_return;
    auto const found = co_await find_old_images();
    for (auto const& image : found) {
        Arguments users{"ps", "--quiet", "--filter", concat("ancestor=", image)};
        auto const used = co_await commands_.docker(std::move(users));
        if (!used || !core::trim(*used).empty())
            continue;
        Arguments removal{"rmi", image};
        auto const removed = co_await commands_.docker(std::move(removal));
        log_.info(removed ? concat("docker: removed the old image ", image)
                          : concat("docker: the old image ", image, " stays: ", removed.error().message()));
    }
}

} // namespace webots_cloud
