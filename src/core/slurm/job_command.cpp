#include "job_command.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr auto time_to_end = std::chrono::minutes(2);

void add_argument(std::vector<std::string>& arguments, std::string_view option, std::string const& value)
{
    if (!value.empty())
        arguments.push_back(concat(option, value));
}

} // namespace

SlurmJobConfig const& job_for(SlurmConfig const& slurm, std::string_view mode,
                              std::vector<std::string> const& labels)
{
    auto const fits = [&](SlurmOverrideConfig const& entry) {
        return (entry.mode.empty() || entry.mode == mode) &&
               (entry.label.empty() || std::ranges::find(labels, entry.label) != labels.end());
    };
    auto const found = std::ranges::find_if(slurm.overrides, fits);
    return found == slurm.overrides.end() ? slurm.job : found->job;
}

Duration job_time_limit(SimulationLauncherConfig const& launching)
{
    return launching.timeout + launching.extendable + launching.start_timeout + time_to_end;
}

std::string job_identity(std::string_view host, std::uint16_t port)
{
    std::string name(host.substr(0, host.find('.')));
    return concat("webots_cloud_", name, "_", std::to_string(port), "_");
}

std::vector<std::string> srun_command(std::filesystem::path const& srun, SlurmJobConfig const& job,
                                      std::string_view name, Duration time_limit, bool copied)
{
    // Slurm counts in minutes.
    auto const limit = job.time_limit > Duration::zero() ? job.time_limit : time_limit;
    auto const minutes = std::chrono::ceil<std::chrono::minutes>(limit).count();
    std::vector<std::string> arguments{srun.native(),
                                       concat("--job-name=", name),
                                       "--nodes=1",
                                       "--ntasks=1",
                                       concat("--cpus-per-task=", std::to_string(job.processors)),
                                       concat("--time=", std::to_string(minutes)),
                                       copied ? "--input=0" : "--input=none",
                                       "--export=ALL",
                                       "--mpi=none"};
    if (copied)
        arguments.emplace_back("--chdir=/"); // ours may not be there
    add_argument(arguments, "--partition=", job.partition);
    add_argument(arguments, "--account=", job.account);
    add_argument(arguments, "--qos=", job.qos);
    add_argument(arguments, "--gres=", job.gres);
    if (job.memory > 0)
        arguments.push_back(concat("--mem=", std::to_string((job.memory + (1 << 20) - 1) >> 20), "M"));
    return arguments;
}

std::vector<std::string> step_command(std::filesystem::path const& srun, std::string_view number)
{
    return {srun.native(),  concat("--jobid=", number),
            "--overlap",    "--nodes=1",
            "--ntasks=1",   "--input=0",
            "--export=ALL", "--mpi=none",
            "--chdir=/"};
}

std::filesystem::path job_folder(std::filesystem::path const& copy_to, std::string_view name)
{
    return copy_to / concat("webots-cloud-job.", name);
}

void name_partitions(SlurmConfig& slurm, std::string const& standard)
{
    auto const name = [&standard](SlurmJobConfig& job) {
        if (job.partition.empty())
            job.partition = standard;
    };
    name(slurm.job);
    for (auto& entry : slurm.overrides)
        name(entry.job);
}

std::vector<std::string> partitions_of(SlurmConfig const& slurm)
{
    std::vector<std::string> partitions{slurm.job.partition};
    for (auto const& entry : slurm.overrides)
        partitions.push_back(entry.job.partition);
    std::ranges::sort(partitions);
    partitions.erase(std::unique(partitions.begin(), partitions.end()), partitions.end());
    return partitions;
}

} // namespace webots_cloud::core
