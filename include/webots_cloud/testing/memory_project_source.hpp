// Projects that exist only in a test.
#pragma once

#include <webots_cloud/testing/fuse.hpp>
#include <webots_cloud/transport/project_source.hpp>

#include <map>
#include <set>
#include <string>
#include <vector>

namespace webots_cloud::testing {

/// Pretends to put projects into directories, and records which were not discarded. Does no I/O.
///
/// Lifetime: `clock` must outlive it.
class MemoryProjectSource final : public ProjectSource
{
public:
    explicit MemoryProjectSource(Clock& clock) : clock_(clock) {}

    /// The project `owner/repository`, or the website's project of that name, has this world, whose first
    /// line is `header`.
    void add(std::string const& repository, std::string const& world,
             std::string header = "#VRML_SIM R2025a utf8")
    {
        worlds_[repository + "/" + world] = std::move(header);
    }

    boost::asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) override;
    boost::asio::awaitable<result<std::vector<ListedWorld>>> list_worlds(FetchOrder order) override;
    boost::asio::awaitable<result<std::string>> current_revision(ProjectRef project) override;
    boost::asio::awaitable<result<>> restore(RestoreOrder order) override;
    boost::asio::awaitable<result<>> discard(std::filesystem::path directory) override;

    RefMeaning ref_meaning() const noexcept override { return refs; }
    bool is_local() const noexcept override { return local; }
    std::vector<std::uint32_t> cached() const override { return in_cache; }

    /// Directories that were fetched into and not discarded; should be empty at the end of a test.
    std::set<std::filesystem::path> const& directories() const noexcept { return directories_; }

    Duration delay{};                ///< How long a fetch takes, or a list of worlds.
    std::vector<ListedWorld> listed; ///< What `list_worlds` finds everywhere.
    std::vector<FetchOrder> lists;   ///< That were asked for.
    bool finishes =
        false; ///< Fetches that have begun succeed even when cancelled, like one whose thread has finished.
    RefMeaning refs = RefMeaning::git;
    bool local = false;                  ///< What `is_local` says.
    std::vector<std::uint32_t> in_cache; ///< What `cached` says.
    std::string revision = "0123456789"; ///< Of what is fetched.
    bool tells_revision = false;         ///< Before it is fetched, as plain folders do.
    std::string notice;                  ///< The notice of what is fetched.
    std::vector<std::string> forbidden;  ///< What what is fetched lacks.
    std::string webots_yml;              ///< The settings of what is fetched.
    bool large_files = false;            ///< The progress of fetches shows large files (Git LFS).
    bool waits = false;                  ///< The progress of fetches shows that they wait for others.
    int fetching = 0;                    ///< Fetches under way.
    std::set<std::string> files;         ///< What can be restored, relative to the root of a project.
    std::vector<std::string> restored;
    Fuse fuse;

private:
    Clock& clock_;
    std::map<std::string, std::string> worlds_;
    std::set<std::filesystem::path> directories_;
};

} // namespace webots_cloud::testing
