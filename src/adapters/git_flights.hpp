// Fetches of the same thing at the same time, merged into one.
#pragma once

#include "git_fetch.hpp"
#include "git_progress.hpp"
#include "worker_threads.hpp"

#include "../async/wakeup.hpp"

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

/// Runs jobs on threads of its own. Who asks for a key that is on its way joins; when all who wait for a job
/// have gone, it is told to stop.
///
/// The destructor stops and waits for all jobs.   Thread-safety: one executor.
class GitFlights
{
public:
    using Job = std::function<result<GitFetched>(std::atomic<bool> const& aborted, GitProgress& progress)>;

    GitFlights(boost::asio::any_io_executor home, std::size_t threads)
        : home_(std::move(home)), threads_(threads, WorkerThreads::Priority::background)
    {}
    ~GitFlights();

    /// The result of `job`, or of the job that is already on its way to `key`.
    ///
    /// Cancellation: terminal; the job goes on for the others.
    boost::asio::awaitable<result<GitFetched>> join(std::string key, std::shared_ptr<FetchProgress> progress,
                                                    Job job);

private:
    struct Flight;

    std::shared_ptr<Flight> start(std::string const& key, Job job);

    boost::asio::any_io_executor home_;
    std::unordered_map<std::string, std::shared_ptr<Flight>> flights_;
    WorkerThreads threads_;
};

} // namespace webots_cloud::adapters
