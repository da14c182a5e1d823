// The limits of one simulation: what they are, when they are overrun, and what its browser is told.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/process_limits.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// What the configuration says, and where it says nothing, what fits a class on this machine: a quarter of
/// its memory, but 2 GB at least, which Webots needs, and 16 GB at most; 1024 processes and threads, and 64
/// more for each processor, since numerical libraries start threads for each.
ProcessLimits simulation_limits(LimitsConfig const& config, std::uint64_t machine_memory, int processors);

/// What a simulation uses, and what the kernel has refused it.
struct Consumption
{
    Consumption() = default;

    std::uint64_t memory = 0;        ///< Bytes.
    std::uint64_t processes = 0;     ///< With their threads.
    std::uint64_t memory_kills = 0;  ///< Processes that the kernel killed for it, at the limit of memory.
    std::uint64_t refused_forks = 0; ///< Processes that the kernel has not started for it, at that limit.
    std::uint64_t disk = 0;          ///< Bytes.
    std::uint64_t images = 0;        ///< Bytes, of its build.
    bool too_many_files = false;     ///< In its folder: more than are counted, or too deep in folders.
};

/// The limit that is overrun, if any.
std::optional<Limit> overrun(ProcessLimits const& limits, Consumption const& used) noexcept;

/// Whether a program ended because it wrote a file larger than all of its files may be: by its signal or, as
/// programs report the end of others, by its exit status.
bool ended_at_file_size(int code, bool signalled) noexcept;

/// What the browser of the simulation is told that has overrun its limit. `is_job`: another key raises that
/// of memory.
Failure overrun_failure(Limit limit, ProcessLimits const& limits, bool is_job = false);

/// As in `/metrics`.
std::string_view label_of(Limit limit) noexcept;

/// Whether no simulation can use up the machine: the kernel keeps memory and processes within limits, and
/// there is one of disk.
bool limits_hold(ProcessLimits const& limits, LimitSupport const& support) noexcept;

/// For the operator, at the start: which limits there are and who keeps them.
std::string limits_text(ProcessLimits const& limits, LimitSupport const& support);

/// What of a simulation's memory can be counted where there are no control groups.
struct CountedMemory
{
    CountedMemory() = default;

    bool private_folders = false; ///< A sandbox gives it folders in memory of its own.
    bool open_files = true;       ///< Files in memory, too, that it has open and not mapped.
};

/// For the operator: which of its limits a simulation can exceed here, and why; a sentence for the log, the
/// monitor page and the doctor. Empty: none.
std::string unkept_limits(ProcessLimits const& limits, LimitSupport const& support,
                          CountedMemory const& counted);

/// The same for jobs of a cluster.
std::string unkept_job_limits(ProcessLimits const& limits);

} // namespace webots_cloud::core
