// What is found out about the processes of a simulation, on threads that may wait.
#pragma once

#include "adapters/threads/blocking_pool.hpp"
#include "control_groups.hpp"

#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

namespace webots_cloud::adapters {

/// The threads. How long they take depends on what the processes do.
struct InspectionThreads
{
    BlockingPool ports{1};
    BlockingPool usage{1, BlockingPool::Priority::background};
    /// Of processes with limits, whose work must not make us late.
    BlockingPool limits{1};
};

/// A group that is removed when its last user is gone, by which time no process should be in it.
struct OwnGroup
{
    OwnGroup(std::shared_ptr<ControlGroups> all, ControlGroups::Group made)
        : groups(std::move(all)), group(std::move(made))
    {}
    OwnGroup(OwnGroup&&) = delete;
    ~OwnGroup() { groups->remove(group); }

    std::shared_ptr<ControlGroups> groups;
    ControlGroups::Group group;
};

/// Whether the processes below `root` listen, and where: work for a thread that may wait.
struct FindPort
{
    std::uint16_t operator()() const;

    pid_t root;
    std::uint16_t first;
    std::uint16_t last;
    /// Not 0: the port that the guard keeps for a tree with a network of its own, and listens on when the
    /// tree does. Nobody else can.
    std::uint16_t relayed;
    std::string broker; ///< Not empty: the Unix socket that the guard listens on in place of the port.
};

/// What the processes below `root` use: by /proc, and where they have control groups, by the kernel's own
/// counters, which also know of those that have ended.
struct TakeUsage
{
    ProcessUsage operator()() const;

    pid_t root;
    std::size_t max_processes;
    std::uint64_t enough_memory;
    bool has_limits;
    std::shared_ptr<OwnGroup const> group;
    std::shared_ptr<GraphicsTimes const> graphics;
};

/// When no process is left: what the kernel has refused them.
struct TakeRefusals
{
    ProcessUsage operator()();

    std::shared_ptr<OwnGroup const> group;
};

// Whoever asks may be destroyed before these have their result.

boost::asio::awaitable<std::uint16_t> find_port(std::shared_ptr<InspectionThreads> inspection, FindPort work);
boost::asio::awaitable<ProcessUsage> take_usage(std::shared_ptr<InspectionThreads> inspection,
                                                TakeUsage work);

/// As `end_writers`.
boost::asio::awaitable<void> end_writers_aside(std::shared_ptr<InspectionThreads> inspection, ino_t pipe);

} // namespace webots_cloud::adapters
