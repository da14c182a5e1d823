// Decisions: core/gallery/world_list, core/projects/repository_policy.
#include "local_worlds.hpp"

#include "async/cancellation.hpp"
#include "core/gallery/world_list.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

namespace webots_cloud {
namespace {

constexpr auto world_search_interval = std::chrono::seconds(30);

} // namespace

boost::asio::awaitable<result<>> LocalWorlds::run()
{
    co_await boost::asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        if (finder_)
            found_ = co_await finder_->find();
        page_.expire();
        bool const cancelled = co_await async::is_cancelled(); // the search is not cancellable
        if (cancelled)
            co_return Failure(boost::asio::error::operation_aborted);
        auto const waited = co_await clock_.wait_until(clock_.now() + world_search_interval);
        if (!waited)
            co_return waited;
    }
}

HttpResponse LocalWorlds::answer(IncomingRequest const& request)
{
    auto const make = [this] { return listed(); };
    return page_.get(clock_.now(), make).answer("application/json", request.header("If-None-Match"));
}

std::vector<ListedWorld>
LocalWorlds::worlds_in(ProjectRef const& folder,
                       std::function<result<ProjectRef>(std::string_view url)> const& parse) const
{
    std::vector<ListedWorld> worlds;
    auto const place = core::concat(folder.folder_after_ref(), "/");
    for (auto const& [world, forge] : found_) {
        auto const found = forge == folder.forge ? parse(world.url) : result<ProjectRef>(Failure());
        if (found && found->owner == folder.owner && found->repository == folder.repository &&
            core::concat(found->folder_after_ref(), "/worlds/").starts_with(place))
            worlds.push_back(world);
    }
    return worlds;
}

/// Those that an idle machine would run.
std::string LocalWorlds::listed() const
{
    std::vector<ListedWorld> worlds;
    for (auto const& [world, forge] : found_)
        if (!core::refusal(policy_, world.url, core::ForgeOfWorld(forge, RefMeaning::none), 0))
            worlds.push_back(world);
    return core::world_list_json(worlds, pictures_.keys());
}

} // namespace webots_cloud
