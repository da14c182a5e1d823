// What a job asks Slurm for, in arguments of `srun`.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// What a simulation in this mode, of a project that needs these labels, asks for.
SlurmJobConfig const& job_for(SlurmConfig const& slurm, std::string_view mode,
                              std::vector<std::string> const& labels);

/// How long jobs may run whose configuration does not say it: our own limits come first, since they are told
/// the browser in time.
Duration job_time_limit(SimulationLauncherConfig const& launching);

/// What the names of all jobs of a server begin with. Part of `host`: its name without a domain.
std::string job_identity(std::string_view host, std::uint16_t port);

/// The command line that is to be continued by that of the program. `time_limit`: where `job` has none.
/// `copied`: the program gets our standard input, and begins in the uppermost folder.
std::vector<std::string> srun_command(std::filesystem::path const& srun, SlurmJobConfig const& job,
                                      std::string_view name, Duration time_limit, bool copied = false);

/// The same for a program beside that of a running job, with our standard input. `number`: Slurm's.
std::vector<std::string> step_command(std::filesystem::path const& srun, std::string_view number);

/// The folder that the project of a job is copied into. What is before the first dot is common to all, as the
/// guard wants it.
std::filesystem::path job_folder(std::filesystem::path const& copy_to, std::string_view name);

/// Names the partition of all jobs that ask for none.
void name_partitions(SlurmConfig& slurm, std::string const& standard);

/// The partitions of all jobs, which are named.
std::vector<std::string> partitions_of(SlurmConfig const& slurm);

} // namespace webots_cloud::core
