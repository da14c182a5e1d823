// Simulations as jobs of a Slurm cluster: which jobs there are, where they run, and how full the cluster is.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What SlurmMode has been given on this machine, found out at the start.
struct SlurmFacts
{
    SlurmFacts() = default;

    /// Absolute paths of the programs; empty: not installed.
    std::filesystem::path srun;
    std::filesystem::path scancel;
    std::filesystem::path squeue;
    std::filesystem::path sinfo;
    std::filesystem::path getent; ///< Of the C library: finds the addresses of nodes.
    std::filesystem::path tar;    ///< Where projects are copied to the nodes.
    std::filesystem::path guard;  ///< `webots-process-guard`, which is there on the nodes too.
    /// Names this server among all that use the cluster, and stays the same from run to run, as in
    /// `webots_cloud_robots_2000_`. The names of its jobs begin with it, so that left-overs are recognised.
    std::string identity;
    /// Tells the names of this run's jobs from those of earlier ones.
    std::string run;
    /// Our own environment, of which Slurm's programs get only what they need.
    std::vector<std::pair<std::string, std::string>> environment;
};

/// Slurm on this machine and its cluster. A live object: await `run()` as long as it is used.
///
/// Lifetime: everything passed by reference must outlive it. It must outlive its operations: await their end
/// before it is destroyed.
/// Thread-safety: one executor.
class SlurmMode
{
public:
    SlurmMode(SlurmConfig config, SlurmFacts facts, ProcessHost& processes, Clock& clock, Logger log);
    ~SlurmMode();

    /// Asks for the nodes, and ends the jobs that an earlier run of this server has left behind.
    ///
    /// Errors: `not_found`: a program is missing, or there is no such partition; `unavailable`: Slurm does
    /// not answer. The detail is a sentence for the operator.
    boost::asio::awaitable<result<>> open();

    /// Asks Slurm again and again for the nodes and, while there are any, for the jobs; ends our own jobs
    /// that nobody waits for.
    ///
    /// Precondition: `open` succeeded.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    SlurmConfig const& config() const noexcept;
    SlurmFacts const& facts() const noexcept;

    /// A name for a job, which nobody else has. The job is known until `forget`.
    std::string new_job(std::string_view label);

    /// The job with this name has ended, or was never there: what Slurm still has of it is ended.
    void forget(std::string const& name) noexcept;

    /// What to tell somebody who waits for the job with this name: a sentence, or nothing.
    std::string news_of(std::string_view name) const;

    /// What Slurm's programs need of our environment besides what every program needs.
    std::vector<std::pair<std::string, std::string>> environment() const;

    /// The numeric address of a node.
    ///
    /// Errors: `not_found`: nobody knows it; the detail is a sentence for the browser.
    boost::asio::awaitable<result<std::string>> address_of(std::string node);

    /// The load of the partitions in place of this machine's: shares of their processors and of their memory
    /// that jobs have. The rest is as `machine` says.
    ///
    /// Lifetime: `machine` and `this` must outlive it.
    std::unique_ptr<HostMetrics> metrics(HostMetrics& machine) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
