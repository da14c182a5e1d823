// Fetches of the same thing at the same time, merged into one.
#pragma once

#include "adapters/threads/worker_threads.hpp"
#include "git_fetch.hpp"
#include "git_progress.hpp"

#include "async/wakeup.hpp"

#include <webots_cloud/error.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>

namespace webots_cloud::adapters {

/// Runs fetches on threads of its own. A request for a key that is already being fetched joins that fetch;
/// when all its callers have gone, it is cancelled. Lookups do not wait for downloads.
///
/// The destructor stops and waits for all fetches.   Thread-safety: one executor.
class GitCoalescedFetches
{
public:
    using Make = std::function<GitFetch(std::atomic<bool> const& aborted, GitProgress& progress)>;

    /// Maximum number of concurrent lookups, and of concurrent downloads.
    GitCoalescedFetches(boost::asio::any_io_executor home, std::size_t threads)
        : home_(std::move(home)), looking_up_(threads, WorkerThreads::Priority::background),
          downloading_(threads, WorkerThreads::Priority::background)
    {}
    ~GitCoalescedFetches();

    /// The result of what `make` returns, or of the fetch that is already on its way to `key`.
    ///
    /// Cancellation: terminal; the fetch goes on for the others.
    boost::asio::awaitable<result<GitFetched>> join(std::string key, std::shared_ptr<FetchProgress> progress,
                                                    Make make);

private:
    struct CoalescedFetch;

    std::shared_ptr<CoalescedFetch> start(std::string const& key, Make const& make);
    void download(std::shared_ptr<CoalescedFetch> shared);

    boost::asio::any_io_executor home_;
    std::unordered_map<std::string, std::shared_ptr<CoalescedFetch>> fetches_;
    WorkerThreads looking_up_;
    WorkerThreads downloading_;
};

} // namespace webots_cloud::adapters
