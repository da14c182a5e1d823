// Where projects come from: the sources of folders, forges and websites.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/project_source.hpp>
#include <webots_cloud/transport/world_finder.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Projects in plain folders of this computer: `<folder>/<owner>/<repository>/[<folder>/]worlds/<file>.wbt`,
/// copied.
///
/// The part of the world's URL that names a branch is ignored: a plain folder is what it is.
std::unique_ptr<ProjectSource> make_directory_source(std::filesystem::path folder);

/// Finds the worlds in the plain folders among the forges; servers are left out, and what no address can
/// name, as in a folder with a blank in its name: the log says so, once for each project.
std::unique_ptr<WorldFinder> make_world_finder(std::vector<ForgeConfig> forges, Logger log = {});

/// What all fetches of projects together may take: memory and disk. A fetch that does not fit waits, or is
/// refused.
class FetchBudget;

/// In bytes. What is fetched already is not counted but for the memory that its index needs while it is used.
std::shared_ptr<FetchBudget> make_fetch_budget(std::uint64_t memory = std::uint64_t{1} << 30,
                                               std::uint64_t disk = std::uint64_t{8} << 30);

/// Where fetched repositories are kept and handed out.
struct GitFolders
{
    GitFolders() = default;
    explicit GitFolders(std::filesystem::path cache, std::filesystem::path instances = {})
        : cache(std::move(cache)), instances(std::move(instances))
    {}

    std::filesystem::path cache; ///< For what was fetched; made if need be.
    /// The existing folder in which the directories of orders will be: the fastest way to hand out a project
    /// there (overlay mounts, reflinks, copies) is found by trying when the source is made, and logged.
    /// Default: empty, projects are copied.
    std::filesystem::path instances;
};

/// Projects in git repositories over HTTP(S). The file that `http` names is read now; what can't be read is
/// not trusted. `budget`: shared with other sources; null: one of its own.
std::unique_ptr<ProjectSource> make_git_source(boost::asio::any_io_executor executor, GitSourceConfig config,
                                               HttpClientConfig http, GitFolders folders, Logger log,
                                               std::shared_ptr<FetchBudget> budget = nullptr);

/// The projects that `init` asks for (`FetchOrder::website`): a copy of the template and, for a user of the
/// website, the zip file that it answers with laid over it. Certificates are verified. `http` and `budget`:
/// as above.
///
/// Errors besides those of `ProjectSource`: `refused`.
std::unique_ptr<ProjectSource> make_website_source(WebsiteSourceConfig config, HttpClientConfig http,
                                                   Logger log, std::shared_ptr<FetchBudget> budget = nullptr);

} // namespace webots_cloud
