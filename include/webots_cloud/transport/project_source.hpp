// Where projects come from, as a seam.
#pragma once

#include <webots_cloud/error.hpp>
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

namespace webots_cloud {

/// How far a fetch is. Written by the source from any thread, read by whoever shows it.
struct FetchProgress
{
    FetchProgress() = default;

    std::atomic<std::uint32_t> objects_total{0}; ///< 0 until the peer has said.
    std::atomic<std::uint32_t> objects_received{0};
    std::atomic<std::uint64_t> bytes_received{0};
    std::atomic<std::uint64_t> large_bytes_total{0}; ///< Of large files (Git LFS); 0 until then.
    std::atomic<std::uint64_t> large_bytes_received{0};
    std::atomic<bool> waiting{false}; ///< For room in memory or on the disk, which others have.
};

/// What a project may cost.
struct FetchLimits
{
    FetchLimits() = default;

    std::uint64_t bytes = std::uint64_t{2} << 30; ///< Received, and again on disk. Default 2 GiB.
    std::uint32_t files = 50'000;                 ///< On disk.
    Duration timeout = std::chrono::minutes(10);  ///< For the whole fetch.
};

/// One project to put into one directory.
struct FetchOrder
{
    FetchOrder() = default;

    ProjectRef project;                    ///< For the sources of forges.
    std::optional<WebsiteProject> website; ///< For the source of websites' projects, instead.
    std::filesystem::path
        directory; ///< Does not exist yet, its parent does; on failure it may hold anything.
    FetchLimits limits;
    std::shared_ptr<FetchProgress> progress = std::make_shared<FetchProgress>();
};

/// What arrived.
struct FetchedProject
{
    FetchedProject() = default;

    std::filesystem::path root; ///< The folder that holds `worlds/`; inside the order's directory.
    std::string revision;       ///< What exactly it is: a commit, for instance.
    std::string world_header;   ///< The first line of the world file, at most 256 bytes of it.
    std::string
        notice; ///< A sentence for the person who asked, such as that it may be out of date; or empty.
};

/// One file to put back as it was fetched.
struct RestoreOrder
{
    RestoreOrder() = default;

    ProjectRef project;
    std::optional<WebsiteProject> website; ///< As in the fetch order.
    std::filesystem::path directory;       ///< Of the fetch order.
    std::filesystem::path root;            ///< Of the fetched project.
    std::string file; ///< Relative to the root: names separated by `/`, none of them `.` or `..`.
};

/// Fetches projects from somewhere. Never works on the caller's thread, never outside the order's directory.
///
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
    /// Errors: `not_found`: the project has no such file; `unavailable`, by default always.
    virtual boost::asio::awaitable<result<>> restore(RestoreOrder)
    {
        co_return Failure(errc::unavailable, "Files of this project can't be restored.");
    }

    /// Removes a directory that was given to `fetch`, with everything in it, whether or not that succeeded.
    virtual boost::asio::awaitable<result<>> discard(std::filesystem::path directory) = 0;
};

} // namespace webots_cloud
