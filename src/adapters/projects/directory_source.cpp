#include "adapters/files/copy_tree.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/files/restore_file.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "project_world.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/projects.hpp>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

fs::path root_of(fs::path const& folder, ProjectRef const& project)
{
    return folder / project.owner / concat(project.repository, project.folder_after_ref());
}

result<FetchedProject> copy_project(fs::path const& folder, FetchOrder const& order,
                                    std::atomic<bool> const& aborted)
{
    auto const& project = order.project;
    auto const root = root_of(folder, project);
    std::error_code failed;
    if (!fs::is_directory(root / "worlds", failed))
        return core::refused(
            core::Refused::no_plain_project,
            {{"name", concat(project.owner, "/", project.repository, project.folder_after_ref())}});
    fs::create_directory(order.directory, failed);
    if (failed)
        return adapters::disk_failure(failed);
    // What changes while it is copied is another state than this.
    auto state = adapters::tree_state(root, order.limits.files, aborted);
    if (auto const copied =
            adapters::copy_tree(root, order.directory, order.limits, *order.progress, aborted);
        !copied)
        return copied.error();
    return adapters::finished_project(order.directory, std::move(state), project.world);
}

/// Projects in a folder of this machine, which are copied for each simulation.
class DirectorySource final : public ProjectSource
{
public:
    explicit DirectorySource(fs::path folder)
        : folder_(std::move(folder)), pool_(2, adapters::BlockingPool::Priority::background)
    {}

    asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        auto work = [folder = folder_, order = std::move(order)](std::atomic<bool> const& aborted) {
            return copy_project(folder, order, aborted);
        };
        co_return co_await pool_.run_abortable(std::move(work));
    }

    asio::awaitable<result<std::string>> current_revision(ProjectRef project) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        auto work = [folder = folder_,
                     project = std::move(project)](std::atomic<bool> const& aborted) -> result<std::string> {
            auto state = adapters::tree_state(root_of(folder, project), FetchLimits().files, aborted);
            if (state.empty())
                return Failure(errc::unavailable, "The folder can't be looked at.");
            return state;
        };
        co_return co_await pool_.run_abortable(std::move(work));
    }

    /// `root_of` drops it.
    RefMeaning ref_meaning() const noexcept override { return RefMeaning::none; }

    bool is_local() const noexcept override { return true; }

    asio::awaitable<result<>> restore(RestoreOrder order) override
    {
        auto work = [folder = folder_, order = std::move(order)] {
            return adapters::restore_file(root_of(folder, order.project), order.root, order.file);
        };
        co_return co_await pool_.run(std::move(work));
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

std::unique_ptr<ProjectSource> make_directory_source(fs::path folder)
{
    return std::make_unique<DirectorySource>(std::move(folder));
}

} // namespace webots_cloud
