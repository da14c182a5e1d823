// Finds the source for an address, has it make a project, and removes that afterwards. The sources do the
// work: adapters/git, adapters/projects.
#include <webots_cloud/load_report.hpp>
#include <webots_cloud/project_fetcher.hpp>

#include "async/cancellation.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <exception>
#include <functional>

namespace webots_cloud {
namespace asio = boost::asio;
namespace fs = std::filesystem;

using core::concat;

struct ProjectFetcher::Impl
{
    Impl(ProjectFetcherParams parameters, std::vector<Forge> sources, Logger logger, ProjectSource* others)
        : params(std::move(parameters)), forges(std::move(sources)), log(std::move(logger)), websites(others)
    {}

    /// The addresses of all forges.
    std::vector<ForgeAddress> bases() const
    {
        std::vector<ForgeAddress> addresses;
        for (auto const& forge : forges)
            addresses.push_back(forge.address);
        return addresses;
    }

    /// By its base URL; null: there is none.
    Forge const* forge_at(std::string const& url) const
    {
        auto const found = std::find_if(forges.begin(), forges.end(),
                                        [&](Forge const& forge) { return forge.address.url == url; });
        return found == forges.end() ? nullptr : &*found;
    }

    /// Errors: `invalid_url` for a project of another forge, which neither `parse` nor `parse_folder` makes.
    result<std::reference_wrapper<ProjectSource>> source_of(ProjectRef const& project) const
    {
        if (auto const* forge = forge_at(project.forge))
            return forge->source;
        return Failure(errc::invalid_url, concat("no forge has the address \"", project.forge, "\""));
    }

    result<std::reference_wrapper<ProjectSource>> source_of(Project const& project) const
    {
        if (project.website)
            return std::ref(*websites);
        return source_of(project.ref);
    }

    /// `order` lacks its directory and limits.
    asio::awaitable<result<Project>> fetch(ProjectSource& source, FetchOrder order, std::string world)
    {
        // Below, cancellation is switched off for the clean-up; that must not outlast it in our caller.
        return async::isolated(fetch_or_remove(source, std::move(order), std::move(world)));
    }

    asio::awaitable<result<Project>> fetch_or_remove(ProjectSource& source, FetchOrder order,
                                                     std::string world)
    {
        order.limits = params.limits;
        // No number is used twice in a run: a folder that could not be removed is in nobody's way.
        order.directory = params.instances / std::to_string(++next);
        auto const directory = order.directory;
        Project project;
        project.ref = order.project;
        project.website = order.website;

        // A fetch that is cancelled or throws has to come back here, since the source may have left a part of
        // the project. One that succeeds although it was cancelled has no caller any more that would discard
        // it. What the source makes of the state of cancellation is its own.
        co_await asio::this_coro::throw_if_cancelled(false);
        result<FetchedProject> fetched = Failure(asio::error::operation_aborted);
        std::exception_ptr thrown;
        try {
            fetched = co_await async::isolated(source.fetch(std::move(order)));
        } catch (...) {
            thrown = std::current_exception();
        }
        bool const is_cancelled = co_await async::is_cancelled();
        if (!fetched || thrown || is_cancelled) {
            co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
            co_await remove(source, directory);
            if (thrown)
                std::rethrow_exception(thrown);
            co_return fetched ? Failure(asio::error::operation_aborted) : fetched.error();
        }
        // From here on the caller has the folder, and discards it.
        project.directory = directory;
        project.world = fetched->root / "worlds" / world;
        project.root = std::move(fetched->root);
        project.world_header = std::move(fetched->world_header);
        project.webots_yml = std::move(fetched->webots_yml);
        project.revision = std::move(fetched->revision);
        project.notice = std::move(fetched->notice);
        project.forbidden = std::move(fetched->forbidden);
        co_return project;
    }

    asio::awaitable<void> remove(ProjectSource& source, fs::path directory)
    {
        auto const removed = co_await source.discard(directory);
        if (!removed)
            log.error(LogCause("directory"),
                      concat("Can't remove ", directory.string(), ": ", removed.error().message()));
    }

    ProjectFetcherParams params;
    std::vector<Forge> forges;
    Logger log;
    ProjectSource* websites;
    std::uint64_t next = 0;
};

ProjectFetcher::ProjectFetcher(ProjectFetcherParams params, std::vector<Forge> forges, Logger log,
                               ProjectSource* websites)
    : impl_(std::make_unique<Impl>(std::move(params), std::move(forges), std::move(log), websites))
{}

ProjectFetcher::~ProjectFetcher() = default;

result<Forge> ProjectFetcher::forge_of(std::string_view url) const
{
    auto const base = webots_cloud::forge_of(url, impl_->bases());
    if (!base)
        return base.error();
    return *impl_->forge_at(base->url);
}

result<ProjectRef> ProjectFetcher::parse(std::string_view url) const
{
    return parse_world_url(url, impl_->bases());
}

result<ProjectRef> ProjectFetcher::parse_folder(std::string_view url) const
{
    return parse_folder_url(url, impl_->bases());
}

asio::awaitable<result<std::vector<ListedWorld>>> ProjectFetcher::list_worlds(ProjectRef folder,
                                                                              FetchLimits limits)
{
    auto const source = impl_->source_of(folder);
    if (!source)
        co_return source.error();
    FetchOrder order;
    order.project = std::move(folder);
    order.limits = limits;
    auto listed = co_await source->get().list_worlds(std::move(order));
    co_return listed;
}

/// Where sources have many, the first of each come first.
std::vector<std::uint32_t> ProjectFetcher::cached() const
{
    std::vector<ProjectSource const*> sources;
    std::vector<std::vector<std::uint32_t>> lists;
    for (Forge const& forge : impl_->forges) {
        // Several forges share one source, which would be listed once for each of them.
        if (std::ranges::find(sources, &forge.source.get()) != sources.end())
            continue;
        sources.push_back(&forge.source.get());
        lists.push_back(forge.source.get().cached());
    }
    std::vector<std::uint32_t> all;
    // In turn, so that one with a full cache does not push the others out of the report.
    for (std::size_t rank = 0; rank != LoadReport::max_projects; ++rank)
        for (auto const& list : lists)
            if (rank < list.size() && all.size() != LoadReport::max_projects)
                all.push_back(list[rank]);
    return all;
}

asio::awaitable<result<Project>> ProjectFetcher::fetch(ProjectRef ref,
                                                       std::shared_ptr<FetchProgress> progress)
{
    auto const source = impl_->source_of(ref);
    if (!source)
        co_return source.error();
    auto world = ref.world;
    FetchOrder order;
    order.project = std::move(ref);
    order.progress = std::move(progress);
    co_return co_await impl_->fetch(*source, std::move(order), std::move(world));
}

asio::awaitable<result<Project>> ProjectFetcher::fetch(WebsiteProject website,
                                                       std::shared_ptr<FetchProgress> progress)
{
    if (!impl_->websites)
        co_return core::refused(core::Refused::no_websites);
    auto world = website.world;
    FetchOrder order;
    order.website = std::move(website);
    order.progress = std::move(progress);
    co_return co_await impl_->fetch(*impl_->websites, std::move(order), std::move(world));
}

asio::awaitable<result<std::string>> ProjectFetcher::current_revision(ProjectRef project)
{
    auto const source = impl_->source_of(project);
    if (!source)
        co_return source.error();
    co_return co_await source->get().current_revision(std::move(project));
}

asio::awaitable<result<>> ProjectFetcher::restore(Project const& project, std::string file)
{
    RestoreOrder order;
    order.project = project.ref;
    order.website = project.website;
    order.directory = project.directory;
    order.root = project.root;
    order.file = std::move(file);
    auto const source = impl_->source_of(project);
    if (!source)
        co_return source.error();
    co_return co_await source->get().restore(std::move(order));
}

asio::awaitable<void> ProjectFetcher::discard(Project project)
{
    if (auto const source = impl_->source_of(project))
        co_await impl_->remove(*source, std::move(project.directory));
}

} // namespace webots_cloud
