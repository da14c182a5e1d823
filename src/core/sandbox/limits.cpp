// Which limits fit this machine, which one is overrun, and the sentences about them for operators and
// browsers.
#include "limits.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <csignal>
#include <cstdio>

namespace webots_cloud::core {
namespace {

constexpr std::uint64_t gigabyte = std::uint64_t{1} << 30;
constexpr int by_signal = 128; // added to its number by programs that report how another one ended

std::string megabytes(std::uint64_t bytes)
{
    return concat(std::to_string(bytes >> 20), " MB");
}

std::string decimal(double number)
{
    char text[32];
    std::snprintf(text, sizeof text, "%g", number);
    return text;
}

} // namespace

ProcessLimits simulation_limits(LimitsConfig const& config, std::uint64_t machine_memory, int processors)
{
    ProcessLimits limits;
    limits.memory =
        config.memory.value_or(std::clamp(machine_memory / 4 >> 20 << 20, 2 * gigabyte, 16 * gigabyte));
    limits.processors = config.processors;
    limits.processes =
        config.processes.value_or(1024 + 64 * static_cast<std::uint64_t>(std::max(processors, 1)));
    limits.files = config.files;
    limits.disk = config.disk;
    return limits;
}

std::optional<Limit> overrun(ProcessLimits const& limits, Consumption const& used) noexcept
{
    if (limits.memory > 0 && (used.memory > limits.memory || used.memory_kills > 0))
        return Limit::memory;
    if (limits.processes > 0 && (used.processes > limits.processes || used.refused_forks > 0))
        return Limit::processes;
    if (limits.disk > 0 && (used.disk > limits.disk || used.too_many_files))
        return Limit::disk;
    if (limits.disk > 0 && used.images > limits.disk)
        return Limit::build;
    return std::nullopt;
}

bool ended_at_file_size(int code, bool signalled) noexcept
{
    return code == (signalled ? SIGXFSZ : by_signal + SIGXFSZ);
}

Failure overrun_failure(Limit limit, ProcessLimits const& limits, bool is_job)
{
    switch (limit) {
    case Limit::memory:
        return refused(is_job ? Refused::job_memory_overrun : Refused::memory_overrun,
                       {{"max", std::to_string(limits.memory >> 20)}});
    case Limit::processes:
        return refused(Refused::process_overrun, {{"max", std::to_string(limits.processes)}});
    case Limit::build:
        return refused(Refused::build_overrun, {{"max", std::to_string(limits.disk >> 20)}});
    case Limit::disk:
        break;
    }
    return refused(Refused::disk_overrun, {{"max", std::to_string(limits.disk >> 20)}});
}

std::string_view label_of(Limit limit) noexcept
{
    switch (limit) {
    case Limit::memory:
        return "memory";
    case Limit::processes:
        return "processes";
    case Limit::build:
        return "build";
    case Limit::disk:
        break;
    }
    return "disk";
}

bool limits_hold(ProcessLimits const& limits, LimitSupport const& support) noexcept
{
    return limits.memory > 0 && support.memory && limits.processes > 0 && support.processes &&
           limits.disk > 0;
}

std::string limits_text(ProcessLimits const& limits, LimitSupport const& support)
{
    if (!limits.any())
        return "Simulations have no limits of their own, as the configuration says.";
    auto const groups = concat(" (control groups, version ", std::to_string(support.version), ")");
    std::string text;
    auto const add = [&text](std::string const& what) { text += concat(text.empty() ? "" : ", ", what); };
    if (limits.memory > 0)
        add(concat(megabytes(limits.memory), " of memory",
                   support.memory ? groups : " (looked at every second)"));
    if (limits.processors > 0 && support.processors)
        add(concat(decimal(limits.processors), " processors", groups));
    else if (support.processors)
        add(concat("an equal share of the processors", groups));
    if (limits.processes > 0)
        add(concat(std::to_string(limits.processes), " processes and threads",
                   support.processes ? groups : " (looked at every second)"));
    if (limits.files > 0)
        add(concat(std::to_string(limits.files), " open files of each process"));
    if (limits.disk > 0)
        add(concat(megabytes(limits.disk), " on disk (looked at every second)"));
    return concat("The limits of each simulation: ", text, ".");
}

std::string unkept_limits(ProcessLimits const& limits, LimitSupport const& support,
                          CountedMemory const& counted)
{
    std::string unkept;
    auto const add = [&unkept](std::string_view what) { unkept += concat(unkept.empty() ? "" : "; ", what); };
    bool const memory_is_watched = limits.memory > 0 && !support.memory;
    bool const processes_are_watched = limits.processes > 0 && !support.processes;
    if (memory_is_watched || processes_are_watched)
        add(concat(memory_is_watched ? "memory" : "",
                   memory_is_watched && processes_are_watched ? " and " : "",
                   processes_are_watched ? "processes" : "", processes_are_watched ? " are" : " is",
                   " looked at every second only, in which a simulation can use much more"));
    if (memory_is_watched)
        add("memory that no process shows, such as the buffers of sockets, is not counted");
    if (memory_is_watched && !counted.open_files)
        add("files in memory without a name are counted as far as they are mapped only");
    if (memory_is_watched && !counted.private_folders)
        add("files in the machine's own folders in memory, such as /dev/shm, are not counted");
    if (limits.processors > 0 && !support.processors)
        add("\"simulationCpus\" has no effect");
    if (unkept.empty())
        return {};
    return concat("Simulations can exceed some of their limits, since this server can make no control groups "
                  "for these (",
                  support.problem, "): ", unkept, " (docs/sandboxes.md, \"Limits\").");
}

std::string unkept_job_limits(ProcessLimits const& limits)
{
    if (limits.memory == 0 && limits.processes == 0)
        return {};
    return "Jobs can exceed some of their limits, unless Slurm keeps them (\"ConstrainRAMSpace\" in its "
           "cgroup.conf), which this server can't know: on the nodes they are looked at every second only, "
           "and "
           "of memory only a job's own pages are counted, not what its processes share, nor files in memory "
           "and "
           "the buffers of sockets (docs/sandboxes.md, \"Limits\").";
}

} // namespace webots_cloud::core
