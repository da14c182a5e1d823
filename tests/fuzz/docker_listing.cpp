// What docker lists: only what is ours is removed, and no name is taken for an option.
#include "fuzz.hpp"

#include "core/docker/docker_leftovers.hpp"
#include "core/text.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

constexpr std::string_view identity = "webots-2000-1f3a9c4d";

/// Names that go to docker's command line.
void check_names(std::vector<std::string> const& names, std::string_view listing)
{
    for (auto const& name : names) {
        fuzz::require(!name.empty() && !name.starts_with('-'));
        fuzz::require(name.find_first_of("\t\n") == std::string::npos);
        fuzz::require(listing.find(name + "\t") != std::string_view::npos);
    }
}

/// A container: whether it is ours, a step of a build, and how it ended.
struct Container
{
    Container() = default;

    std::string id;
    std::string project;
    std::string server;
    std::string status;
};

std::vector<Container> cook(std::string_view recipe)
{
    constexpr std::string_view projects[] = {"",
                                             "webots-2000-1f3a9c4d-1",
                                             "webots-2000-1f3a9c4d-2",
                                             "webots-2000-1f3a9c4d",
                                             "webots-2000-1f3a9c4e-1",
                                             "other"};
    constexpr std::string_view servers[] = {"", identity, "webots-2000-1f3a9c4d2"};
    constexpr std::string_view states[] = {"Up 2 hours", "Created", "Exited (0) 1 hour ago",
                                           "Exited (1) 1 hour ago"};
    std::vector<Container> containers;
    while (!recipe.empty() && containers.size() < 20) {
        auto& container = containers.emplace_back();
        container.id = "c" + std::to_string(containers.size());
        container.project = projects[fuzz::take_byte(recipe) % std::size(projects)];
        container.server = servers[fuzz::take_byte(recipe) % std::size(servers)];
        container.status = states[fuzz::take_byte(recipe) % std::size(states)];
    }
    return containers;
}

void check_ours(std::string_view recipe)
{
    auto const containers = cook(recipe);
    std::string listing;
    std::vector<std::string> of_server;
    std::vector<std::string> of_project;
    std::vector<std::string> unstarted;
    for (auto const& each : containers) {
        listing += each.id + "\t\"" + each.project + "\"\t\"" + each.server + "\"\t" + each.status + "\n";
        bool const is_build = each.project.empty() && each.server == identity;
        bool const is_failed_build = is_build && each.status.starts_with("Exited (1)");
        if (each.project.starts_with("webots-2000-1f3a9c4d-") || is_failed_build)
            of_server.push_back(each.id);
        if (each.project == "webots-2000-1f3a9c4d-1" || is_failed_build)
            of_project.push_back(each.id);
        if (is_build && each.status == "Created")
            unstarted.push_back(each.id);
    }
    core::DockerScope scope;
    scope.identity = identity;
    fuzz::require(core::leftovers(listing, scope) == of_server);
    scope.project = "webots-2000-1f3a9c4d-1";
    fuzz::require(core::leftovers(listing, scope) == of_project);
    fuzz::require(core::unstarted_builds(listing, identity) == unstarted);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const listing = fuzz::text_of(data, std::min<std::size_t>(size, 1024)); // more says nothing new
    core::DockerScope scope;
    scope.identity = identity;
    check_names(core::leftovers(listing, scope), listing);
    check_names(core::unstarted_builds(listing, identity), listing);
    core::ImagePolicy policy;
    policy.repository = "cyberbotics/webots.cloud";
    policy.persistent = {"cyberbotics/webots.cloud:R2025a"};
    WallTime const now = std::chrono::sys_days(std::chrono::year(2026) / 11 / 22);
    auto const old = core::old_images(listing, policy, now);
    check_names(old, listing);
    for (auto const& image : old) {
        fuzz::require(image != policy.persistent.front());
        fuzz::require(image.starts_with("cyberbotics/webots.cloud:"));
    }
    check_names(core::old_builds(listing, now), listing);
    scope.project = "webots-2000-1f3a9c4d-1";
    auto const named = core::named_images(listing, scope);
    check_names(named, listing);
    for (auto const& image : named)
        fuzz::require(image.starts_with(scope.project));
    check_ours(listing);
    return 0;
}
