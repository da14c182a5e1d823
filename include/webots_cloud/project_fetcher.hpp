// Turns what a browser asked for into a directory that a simulator can run, and takes it away afterwards.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud {

/// A source and the addresses that it fetches.
struct Forge
{
    Forge(std::string url, ProjectSource& source) : url(std::move(url)), source(source) {}

    std::string url; ///< Base URL of world addresses, without a slash at the end: `https://github.com`.
    std::reference_wrapper<ProjectSource> source;
};

struct ProjectFetcherParams
{
    ProjectFetcherParams() = default;

    /// The existing folder in which instance directories are made; nobody else's (see `InstanceRoot`).
    std::filesystem::path instances;
    FetchLimits limits;
};

/// A fetched project in a directory of its own. Give it back with `ProjectFetcher::discard`.
struct Project
{
    Project() = default;

    ProjectRef ref;                        ///< What was asked for.
    std::optional<WebsiteProject> website; ///< What was asked for instead.
    std::filesystem::path directory;       ///< The instance directory; all of the project is inside.
    std::filesystem::path root;            ///< The folder that holds `worlds/`.
    std::filesystem::path world;           ///< The world file, absolute.
    std::string world_header; ///< Its first line, which names the release of Webots it was made with.
    std::string revision;     ///< What exactly was fetched: a commit, for instance.
    std::string notice;       ///< A sentence for the person who asked; or empty.
};

/// Fetches projects into instance directories. How many at a time is the matter of each source, so that one
/// whose server is slow holds up no other.
///
/// Lifetime: the sources must outlive the fetcher, and the fetcher its operations.
/// Thread-safety: one executor.
class ProjectFetcher
{
public:
    /// `websites`: the source of the projects of websites; null: they are refused.
    ProjectFetcher(ProjectFetcherParams params, std::vector<Forge> forges, Logger log,
                   ProjectSource* websites = nullptr);
    ~ProjectFetcher();

    /// The forge that a world is on.
    /// Errors: as `webots_cloud::forge_of`.
    result<std::string> forge_of(std::string_view url) const;

    /// Takes a world URL apart.
    /// Errors: as `parse_world_url`.
    result<ProjectRef> parse(std::string_view url) const;

    /// Fetches a project into a fresh directory. Its source makes sure that the world is there.
    ///
    /// Cancellation: terminal; completes when nothing of it is left on disk.
    /// Errors: as `ProjectSource::fetch`; `not_found` for the world file.
    boost::asio::awaitable<result<Project>> fetch(ProjectRef project,
                                                  std::shared_ptr<FetchProgress> progress);

    /// The same for a project that a website's page asked for.
    /// Errors: `refused` too.
    boost::asio::awaitable<result<Project>> fetch(WebsiteProject project,
                                                  std::shared_ptr<FetchProgress> progress);

    /// Puts one of a project's files, named relative to its root, back as it was fetched.
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
