// The tables that `squeue` and `sinfo` print: which jobs there are, and which nodes.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The arguments with which `squeue` prints the jobs of all users, those that wait in the order of their
/// priority. For people who wait: the names of others may have line breaks in them, and be rows of their own.
std::vector<std::string> queue_arguments(std::vector<std::string> const& partitions);

/// The arguments with which it prints those of this server's user alone: what may be cancelled.
std::vector<std::string> own_queue_arguments(std::vector<std::string> const& partitions);

/// The arguments with which `scancel` ends these jobs.
std::vector<std::string> cancel_arguments(std::vector<std::string> jobs);

/// The format of moments for Slurm's programs, in the variable `SLURM_TIME_FORMAT`: seconds since 1970.
inline constexpr std::string_view slurm_time_format = "%s";

/// A job that has not ended.
struct QueuedJob
{
    QueuedJob() = default;

    std::string id;
    std::string name;
    bool waits = false;            ///< For a node.
    bool ends = false;             ///< Slurm is about to remove it.
    std::string reason;            ///< Why it waits, in a word of Slurm's.
    std::optional<WallTime> start; ///< When Slurm thinks that it will start.

    bool operator==(QueuedJob const&) const = default;
};

/// Lines that are none are left out: a job's number has digits alone.
std::vector<QueuedJob> parse_queue(std::string_view printed);

/// What somebody is told who waits for this job; empty: it does not wait, or is not there.
std::string waiting_text(std::vector<QueuedJob> const& queue, std::string_view name, WallTime now);

/// The numbers of the jobs whose names begin with `identity`, but for `known` names and those that end.
std::vector<std::string> strangers(std::vector<QueuedJob> const& queue, std::string_view identity,
                                   std::vector<std::string> const& known);

/// The arguments with which `sinfo` prints the partitions.
std::vector<std::string> partition_arguments();

struct ClusterPartitions
{
    ClusterPartitions() = default;

    std::vector<std::string> names;
    std::string standard; ///< Of jobs that ask for none; empty: there is no such.

    bool operator==(ClusterPartitions const&) const = default;
};

ClusterPartitions parse_partitions(std::string_view printed);

/// The arguments with which `sinfo` prints the nodes of these partitions.
std::vector<std::string> node_arguments(std::vector<std::string> const& partitions);

struct ClusterNode
{
    ClusterNode() = default;

    std::string name;
    std::string address;
    std::uint64_t allocated = 0;        ///< Processors that jobs have.
    std::uint64_t idle = 0;             ///< Processors that jobs could have.
    std::uint64_t memory = 0;           ///< Megabytes.
    std::uint64_t allocated_memory = 0; ///< Megabytes.

    bool operator==(ClusterNode const&) const = default;
};

/// Each node once, even if it is in several partitions.
std::vector<ClusterNode> parse_nodes(std::string_view printed);

/// How full the nodes together are.
struct ClusterLoad
{
    ClusterLoad() = default;

    std::uint64_t allocated = 0;  ///< Processors.
    std::uint64_t processors = 0; ///< That jobs have or could have.
    std::uint64_t memory = 0;     ///< Megabytes of these nodes.
    double memory_used = 0;       ///< Percent.

    bool operator==(ClusterLoad const&) const = default;
};

/// Nodes that are down or drained have no processors to offer, and do not count.
ClusterLoad load_of_nodes(std::vector<ClusterNode> const& nodes);

} // namespace webots_cloud::core
