// Where projects come from, as a seam.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/listed_world.hpp>
#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/website_project.hpp>

#include <boost/asio/awaitable.hpp>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// How far a fetch is, for people: nothing is decided by it. Written by the source from any thread, read by
/// the one that shows it. Other sources than that of git report `bytes_received` and `waiting` alone.
///
/// The progress of several fetches can't be added up: fetches that share a download each see all of it, and
/// `bytes_received` may begin again at 0. To count downloads, see docs/recipes.md ("A figure").
struct FetchProgress
{
    FetchProgress() = default;

    /// Git objects of the pack that is being received. 0: the server has not said yet, or there is no pack.
    std::atomic<std::uint32_t> objects_total{0};
    std::atomic<std::uint32_t> objects_received{0}; ///< Of `objects_total`.
    /// Of packs of git, and of zip files, as compressed by the server; of folders, copied. A website's
    /// template is copied first; then it is that of the zip file, from 0.
    std::atomic<std::uint64_t> bytes_received{0};
    /// Of the files in Git LFS, which are received after the packs. 0: none is wanted, or not yet.
    std::atomic<std::uint64_t> large_bytes_total{0};
    std::atomic<std::uint64_t> large_bytes_received{0}; ///< Of `large_bytes_total`.
    /// The fetch stands still until other fetches give back memory or disk.
    std::atomic<bool> waiting{false};
};

/// The largest project that is fetched. Each source enforces this itself, while the project arrives or is
/// copied: what is beyond a limit is neither stored nor allocated.
struct FetchLimits
{
    FetchLimits() = default;

    /// Two limits of the same size: bytes received, and bytes of all files on disk. Of a website, template
    /// and zip may each have this many. 2 GiB.
    std::uint64_t bytes = std::uint64_t{2} << 30;
    std::uint32_t files = 50'000; ///< On disk.
    /// For a fetch, of git for its look-up and its download apart; copies of folders have none.
    Duration timeout = std::chrono::minutes(10);
};

/// One project to put into one directory.
struct FetchOrder
{
    FetchOrder() = default;

    ProjectRef project;                    ///< For the sources of forges.
    std::optional<WebsiteProject> website; ///< For the source of websites' projects, instead.
    /// Where the project goes. The caller has made its parent, and the source makes the directory itself.
    /// After a failure it may be there or not, with anything in it: the caller gives it to `discard`.
    std::filesystem::path directory;
    FetchLimits limits;
    std::shared_ptr<FetchProgress> progress = std::make_shared<FetchProgress>();
};

/// A fetched project.
struct FetchedProject
{
    FetchedProject() = default;

    std::filesystem::path root; ///< The folder that holds `worlds/`; inside the order's directory.
    std::string revision;       ///< Which version it is: a commit, for instance.
    std::string world_header;   ///< The first line of the world file, at most 256 bytes of it.
    std::string
        webots_yml; ///< The beginning of `webots.yml`, or else `webots.yaml`, in the root: at most 64 KiB.
    std::string
        notice; ///< A sentence for the user, for instance that the project may be out of date; or empty.
    /// What it lacks, since its names could do harm: printable paths, at most 16.
    std::vector<std::string> forbidden;
};

/// One file to put back as it was fetched.
struct RestoreOrder
{
    RestoreOrder() = default;

    ProjectRef project;
    std::optional<WebsiteProject> website; ///< As in the fetch order.
    std::filesystem::path directory;       ///< Of the fetch order.
    /// Of the fetched project; or another folder, which may be empty: what is missing is made.
    std::filesystem::path root;
    std::string file; ///< Relative to the root: names separated by `/`, none of them `.` or `..`.
};

/// Fetches projects from somewhere: a folder, a server, or what a program of yours has.
///
/// Simulators run what arrives, and strangers may have written it. So every source guarantees:
///
/// - It works on threads of its own, never on the caller's, and ends soon when it is cancelled.
/// - It writes below the order's directory (and in folders of its own: a cache, or one that is gone again
///   afterwards), never through a link that has arrived, and nothing after `fetch` has completed.
/// - Each name that arrives is that of one file or folder: at most 255 bytes, without slashes, backslashes
///   and zeros, neither `.` nor `..`, nor `.git` in any spelling that a file system takes for it. What has
///   another name is left out and in `FetchedProject::forbidden`, or the project is refused.
/// - Symbolic links are relative and stay inside the root, or are left out; so are devices, pipes and
///   sockets. Nobody but the owner may write what has arrived.
/// - `restore` and `discard` cope with all that a simulation may have made of the directory.
/// - Certificates of servers are verified. Servers get no credentials but those that the operator has meant
///   for them. Redirects to other hosts are not followed unchecked.
///
/// What a source throws, ProjectFetcher passes on when it has discarded the directory.
/// Lifetime: must outlive its operations: await their end before it is destroyed.
/// Thread-safety: one executor.
class ProjectSource
{
public:
    virtual ~ProjectSource() = default;

    /// Puts the project into the order's directory and makes sure that its world is there.
    ///
    /// Cancellation: terminal; completes only when nothing writes into the directory any more.
    /// Errors: `not_found` (repository, branch, folder or world), `unreachable`, `timed_out`, `too_large`,
    /// `protocol_error`, and `refused` by the website; the detail is a sentence for the person who asked.
    virtual boost::asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) = 0;

    /// Puts one file of a fetched project back as it was. Called between `fetch` and `discard` only.
    ///
    /// Cancellation: none.
    /// Errors: `not_found`: the project has no such file; `unavailable`: this source can't do it, which is
    /// what a source without an override answers.
    virtual boost::asio::awaitable<result<>> restore(RestoreOrder)
    {
        co_return Failure(errc::unavailable, "Files of this project can't be restored.");
    }

    /// The worlds in the folder that the order's project names, and below it, with what they say of
    /// themselves; of very many the first. The order needs no directory, and nothing is kept.
    ///
    /// Cancellation: terminal.
    /// Errors: as `fetch`; `unavailable`: this source can't do it, which is what a source without an override
    /// answers.
    virtual boost::asio::awaitable<result<std::vector<ListedWorld>>> list_worlds(FetchOrder)
    {
        co_return Failure(errc::unavailable, "Worlds can't be listed here.");
    }

    /// The revision that a fetch would get now, for sources that find it out at little cost.
    ///
    /// Cancellation: terminal.
    /// Errors: `unavailable`: this source can't, which is what one without an override answers, or not now.
    virtual boost::asio::awaitable<result<std::string>> current_revision(ProjectRef)
    {
        co_return Failure(errc::unavailable, "The revision is known only once it is fetched.");
    }

    /// What the ref in the address of a world means to it. Asked of the sources of forges.
    virtual RefMeaning ref_meaning() const noexcept { return RefMeaning::unknown; }

    /// Whether its projects are in a folder of this machine: `WorldFinder` finds their worlds, and
    /// `list_worlds` is not asked.
    virtual bool is_local() const noexcept { return false; }

    /// The projects that can be fetched from a cache of its own, by their `project_key`, those used last
    /// first; at most as many as a LoadReport has. A hint: some may be gone. Does no I/O.
    virtual std::vector<std::uint32_t> cached() const { return {}; }

    /// Removes a directory that was given to `fetch`, with everything in it, whether or not that succeeded.
    virtual boost::asio::awaitable<result<>> discard(std::filesystem::path directory) = 0;
};

} // namespace webots_cloud
