// One download that several starts wait for, and what each of their browsers sees of it.
#pragma once

#include <webots_cloud/transport/project_source.hpp>

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {

/// Passes progress on to everyone who has joined.   Thread-safety: any thread.
class GitProgress
{
public:
    void join(std::shared_ptr<FetchProgress> progress)
    {
        std::lock_guard const lock(mutex_);
        joined_.push_back(std::move(progress));
    }

    void report(std::uint32_t objects_total, std::uint32_t objects_received, std::uint64_t bytes_received)
    {
        std::lock_guard const lock(mutex_);
        for (auto const& progress : joined_) {
            progress->objects_total = objects_total;
            progress->objects_received = objects_received;
            progress->bytes_received = bytes_received;
        }
    }

    /// Once there are any.
    void report_large_files(std::uint64_t bytes_total, std::uint64_t bytes_received)
    {
        std::lock_guard const lock(mutex_);
        for (auto const& progress : joined_) {
            progress->large_bytes_received = bytes_received;
            progress->large_bytes_total = bytes_total;
        }
    }

    /// Waiting for room in the budget, while other projects are fetched.
    void report_waiting(bool waiting)
    {
        std::lock_guard const lock(mutex_);
        for (auto const& progress : joined_)
            progress->waiting = waiting;
    }

private:
    std::mutex mutex_;
    std::vector<std::shared_ptr<FetchProgress>> joined_;
};

} // namespace webots_cloud::adapters
