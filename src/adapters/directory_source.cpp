#include "blocking_pool.hpp"
#include "copy_tree.hpp"
#include "project_world.hpp"
#include "remove_tree.hpp"

#include "../core/text.hpp"

#include <webots_cloud/adapters.hpp>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

result<FetchedProject> copy_project(fs::path const& folder, FetchOrder const& order,
                                    std::atomic<bool> const& aborted)
{
    auto const& project = order.project;
    auto root = folder / project.owner / project.repository;
    auto const slash = project.ref_and_folder.find('/');
    if (slash != std::string::npos)
        root /= project.ref_and_folder.substr(slash + 1); // the part before is a branch, which a folder does not have
    std::error_code failed;
    if (!fs::is_directory(root / "worlds", failed))
        return Failure(errc::not_found, concat("There is no project ", project.owner, "/", project.repository,
                                               slash == std::string::npos ? "" : project.ref_and_folder.substr(slash),
                                               " with a folder \"worlds\" on this server."));
    fs::create_directory(order.directory, failed);
    if (failed)
        return Failure(errc::unavailable, concat("This server can't store the project: ", failed.message(), "."));
    if (auto const copied = adapters::copy_tree(root, order.directory, order.limits, *order.progress, aborted);
        !copied)
        return copied.error();
    auto header = adapters::read_world_header(order.directory, project.world);
    if (!header)
        return header.error();
    FetchedProject fetched;
    fetched.root = order.directory;
    fetched.revision = "folder";
    fetched.world_header = std::move(*header);
    return fetched;
}

class DirectorySource final : public ProjectSource
{
public:
    explicit DirectorySource(fs::path folder) : folder_(std::move(folder)), pool_(2) {}

    asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        auto work = [folder = folder_, order = std::move(order)](std::atomic<bool> const& aborted) {
            return copy_project(folder, order, aborted);
        };
        co_return co_await pool_.run_abortable(std::move(work));
    }

    asio::awaitable<result<>> discard(fs::path directory) override
    {
        auto work = [directory = std::move(directory)] { return adapters::remove_tree(directory); };
        co_return co_await pool_.run(std::move(work));
    }

private:
    fs::path folder_;
    adapters::BlockingPool pool_;
};

} // namespace

std::unique_ptr<ProjectSource> make_directory_source(asio::any_io_executor, fs::path folder)
{
    return std::make_unique<DirectorySource>(std::move(folder));
}

} // namespace webots_cloud
