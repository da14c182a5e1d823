// Fetches the projects that browsers ask for into directories that simulators can run, and removes them.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A source, and the base of the world addresses that it fetches.
struct Forge
{
    Forge(ForgeAddress address, ProjectSource& source) : address(std::move(address)), source(source) {}

    ForgeAddress address;
    std::reference_wrapper<ProjectSource> source;
};

/// Where ProjectFetcher puts projects, and the limits on them.
struct ProjectFetcherParams
{
    ProjectFetcherParams() = default;

    /// An existing folder for instance directories, which are called `1`, `2` and so on: empty at first, and
    /// of this fetcher alone. No other user should be able to write to it.
    std::filesystem::path instances;
    FetchLimits limits;
};

/// A fetched project in a directory of its own. Give it back with `ProjectFetcher::discard`.
struct Project
{
    Project() = default;

    ProjectRef ref;                        ///< The request of a `start`.
    std::optional<WebsiteProject> website; ///< The request of an `init`, instead of `ref`.
    std::filesystem::path directory;       ///< The instance directory, with all of the project in it.
    std::filesystem::path root;            ///< The folder that holds `worlds/`.
    std::filesystem::path world;           ///< The world file, absolute.
    std::string world_header; ///< The first line of the world file, which names a release of Webots.
    std::string webots_yml;   ///< The beginning of its `webots.yml`, or else `webots.yaml`: at most 64 KiB.
    std::string revision;     ///< The version that was fetched: a commit, for instance.
    std::string notice;       ///< A sentence for the user, or empty.
    std::vector<std::string> forbidden; ///< Files that it lacks: see `FetchedProject::forbidden`.
};

/// Fetches projects into instance directories. Each source limits how many it fetches at a time, so that a
/// slow server delays only its own projects.
///
/// Lifetime: the sources must outlive the fetcher, and the fetcher must outlive its operations: await their
/// end before it is destroyed.
/// Thread-safety: one executor.
class ProjectFetcher
{
public:
    /// `websites`: the source for requests by `init`; null: they are refused.
    ProjectFetcher(ProjectFetcherParams params, std::vector<Forge> forges, Logger log,
                   ProjectSource* websites = nullptr);
    ~ProjectFetcher();

    /// The forge of a world.
    ///
    /// Errors: as `webots_cloud::forge_of`.
    result<Forge> forge_of(std::string_view url) const;

    /// Parses a world URL.
    ///
    /// Errors: as `parse_world_url`.
    result<ProjectRef> parse(std::string_view url) const;

    /// Parses the URL of a folder.
    ///
    /// Errors: as `parse_folder_url`.
    result<ProjectRef> parse_folder(std::string_view url) const;

    /// The worlds in a folder, as far as one of the sources can list them, within these limits.
    ///
    /// Cancellation: terminal.
    /// Errors: as `ProjectSource::list_worlds`.
    boost::asio::awaitable<result<std::vector<ListedWorld>>> list_worlds(ProjectRef folder,
                                                                         FetchLimits limits);

    /// Projects that are in caches, as `ProjectSource::cached` says, of all sources.
    std::vector<std::uint32_t> cached() const;

    /// Fetches a project into a new directory. The source checks that the world is there.
    ///
    /// Cancellation: terminal; completes when nothing of it is left on disk. A project that arrives all the
    /// same, once cancelled, is removed, too.
    /// Errors: as `ProjectSource::fetch`; `invalid_url` for a project of none of the forges. What a source
    /// throws passes through when its directory has been removed.
    boost::asio::awaitable<result<Project>> fetch(ProjectRef project,
                                                  std::shared_ptr<FetchProgress> progress);

    /// The same for a request by `init`.
    ///
    /// Errors: `refused` too.
    boost::asio::awaitable<result<Project>> fetch(WebsiteProject project,
                                                  std::shared_ptr<FetchProgress> progress);

    /// As `ProjectSource::current_revision`.
    boost::asio::awaitable<result<std::string>> current_revision(ProjectRef project);

    /// Restores one of a project's files, named relative to its root, as it was fetched.
    ///
    /// Lifetime: await it before the project is discarded.
    /// Cancellation: none.
    /// Errors: as `ProjectSource::restore`.
    boost::asio::awaitable<result<>> restore(Project const& project, std::string file);

    /// Removes a project's directory.
    boost::asio::awaitable<void> discard(Project project);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
