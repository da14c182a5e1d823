#include "job_output.hpp"

#include "core/text.hpp"

#include <charconv>

namespace webots_cloud::core {
namespace {

constexpr std::string_view guard_prefix = "webots-process-guard ";

bool contains(std::string_view line, std::string_view part)
{
    return line.find(part) != std::string_view::npos;
}

/// What follows `part` in `line`, up to the end.
std::string_view after(std::string_view line, std::string_view part)
{
    auto const at = line.find(part);
    return at == std::string_view::npos ? std::string_view() : line.substr(at + part.size());
}

/// Why a running job is ended; empty: the line does not say.
std::string why_it_ends(std::string_view line)
{
    if (contains(line, "DUE TO TIME LIMIT"))
        return "The simulation was ended by Slurm: its job has reached its time limit.";
    if (contains(line, "DUE TO PREEMPTION"))
        return "The simulation was ended by Slurm, which needs its node for a more important job.";
    if (contains(line, "DUE TO NODE FAILURE") || contains(line, "Node failure on "))
        return "The simulation has ended: its node of the cluster has failed.";
    if (contains(line, "oom-kill event") || contains(line, "OOM Killed"))
        return "The simulation was ended: it needed more memory than its job may have.";
    if (contains(line, " CANCELLED AT "))
        return "The simulation was ended: its job was cancelled.";
    return {};
}

/// Why a job does not start.
std::string why_it_does_not_start(std::string_view line)
{
    if (auto const reason = after(line, "Unable to allocate resources: "); !reason.empty())
        return concat("Slurm does not start the simulation: ", printable(trim(reason), 200), ".");
    if (contains(line, "Job has been cancelled") || contains(line, " has been revoked"))
        return "The simulation was cancelled while it waited for a node of the cluster.";
    if (auto const reason = after(line, "srun: error: Invalid "); !reason.empty())
        return concat("Slurm does not start the simulation: invalid ", printable(trim(reason), 200), ".");
    return {};
}

} // namespace

JobOutput::Line JobOutput::read(std::string_view line)
{
    if (line.starts_with(guard_prefix))
        return read_guard(line);
    bool const is_of_srun = line.starts_with("srun: ");
    if (!is_of_srun && !line.starts_with("slurmstepd"))
        return Line::simulators;
    if (!node_.empty() || !is_of_srun) {
        if (auto const reason = why_it_ends(line); !reason.empty())
            return end(reason);
        if (contains(line, "couldn't chdir to"))
            return end(
                "The node of the cluster does not see the simulation's project: the folder \"stateDir\" "
                "of the simulation server must be shared with all nodes.");
        return Line::ours;
    }
    if (line.ends_with("queued and waiting for resources"))
        return Line::waits;
    if (auto const reason = why_it_does_not_start(line); !reason.empty())
        return end(reason);
    return Line::ours;
}

JobOutput::Line JobOutput::read_guard(std::string_view line)
{
    auto const words = split(line, ' ');
    if (words.size() != 5)
        return Line::simulators;
    if (word_.empty() && words[2] == "runs") {
        word_ = words[1];
        node_ = words[4];
        return Line::runs;
    }
    if (word_.empty() || words[1] != word_ || words[2] != "listens")
        return Line::simulators;
    std::from_chars(words[4].data(), words[4].data() + words[4].size(), port_);
    return Line::listens;
}

JobOutput::Line JobOutput::end(std::string_view reason)
{
    if (reason_.empty()) // further lines only say that it is killed
        reason_ = reason;
    return Line::ends;
}

} // namespace webots_cloud::core
