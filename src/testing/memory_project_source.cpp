#include <webots_cloud/testing/memory_project_source.hpp>

#include <boost/asio/this_coro.hpp>

namespace webots_cloud::testing {

boost::asio::awaitable<result<FetchedProject>> MemoryProjectSource::fetch(FetchOrder order)
{
    directories_.insert(order.directory);
    if (finishes)
        co_await boost::asio::this_coro::reset_cancellation_state(boost::asio::disable_cancellation());
    if (auto failure = fuse.strike())
        co_return std::move(*failure);
    ++fetching;
    order.progress->objects_total = 10;
    order.progress->objects_received = 4;
    order.progress->bytes_received = 12'300'000;
    if (large_files) {
        order.progress->large_bytes_total = 16'000'000;
        order.progress->large_bytes_received = 4'500'000;
    }
    order.progress->waiting = waits;
    auto const waited = co_await clock_.wait_until(clock_.now() + delay);
    --fetching;
    if (!waited)
        co_return waited.error();
    auto const& world = order.website ? order.website->world : order.project.world;
    auto const project =
        order.website ? order.website->project : order.project.owner + "/" + order.project.repository;
    auto const found = worlds_.find(project + "/" + world);
    if (found == worlds_.end())
        co_return Failure(errc::not_found, world + " does not exist.");
    FetchedProject fetched;
    fetched.root = order.directory / "project";
    fetched.revision = revision;
    fetched.world_header = found->second;
    fetched.notice = notice;
    fetched.forbidden = forbidden;
    fetched.webots_yml = webots_yml;
    co_return fetched;
}

boost::asio::awaitable<result<std::vector<ListedWorld>>> MemoryProjectSource::list_worlds(FetchOrder order)
{
    lists.push_back(std::move(order));
    if (auto failure = fuse.strike())
        co_return std::move(*failure);
    auto const waited = co_await clock_.wait_until(clock_.now() + delay);
    if (!waited)
        co_return waited.error();
    co_return listed;
}

boost::asio::awaitable<result<std::string>> MemoryProjectSource::current_revision(ProjectRef)
{
    if (!tells_revision)
        co_return Failure(errc::unavailable, "It is known only once it is fetched.");
    co_return revision;
}

boost::asio::awaitable<result<>> MemoryProjectSource::restore(RestoreOrder order)
{
    if (auto failure = fuse.strike())
        co_return std::move(*failure);
    if (!directories_.contains(order.directory) || !files.contains(order.file))
        co_return Failure(errc::not_found, "The project has no file " + order.file + ".");
    restored.push_back((order.root / order.file).string());
    co_return result<>();
}

boost::asio::awaitable<result<>> MemoryProjectSource::discard(std::filesystem::path directory)
{
    directories_.erase(directory);
    co_return result<>();
}

} // namespace webots_cloud::testing
