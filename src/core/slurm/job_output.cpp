// Sorts lines of a job by who wrote them: Slurm, our guard, or the simulator, which may imitate the first but
// not the second. The sentences for browsers are made here too.
#include "job_output.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <charconv>

namespace webots_cloud::core {
namespace {

constexpr std::string_view guard_prefix = "webots-process-guard ";
constexpr std::string_view cannot_send = "webots-process-guard can't send"; // the guard on this machine
constexpr std::string_view tar_prefix = "tar: ";

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

/// Why a running job is ended; nothing: the line does not say.
std::optional<Failure> why_it_ends(std::string_view line)
{
    if (contains(line, "DUE TO TIME LIMIT"))
        return refused(Refused::job_time_limit);
    if (contains(line, "DUE TO PREEMPTION"))
        return refused(Refused::job_preempted);
    if (contains(line, "DUE TO NODE FAILURE") || contains(line, "Node failure on "))
        return refused(Refused::node_failed);
    if (contains(line, "oom-kill event") || contains(line, "OOM Killed"))
        return refused(Refused::job_memory);
    if (contains(line, " CANCELLED AT "))
        return refused(Refused::job_cancelled);
    return std::nullopt;
}

/// Why a job does not start.
std::optional<Failure> why_it_does_not_start(std::string_view line)
{
    if (auto const reason = after(line, "Unable to allocate resources: "); !reason.empty())
        return refused(Refused::job_refused, {{"words", printable(trim(reason), 200)}});
    if (contains(line, "Job has been cancelled") || contains(line, " has been revoked"))
        return refused(Refused::job_cancelled_early);
    if (auto const reason = after(line, "srun: error: Invalid "); !reason.empty())
        return refused(Refused::job_invalid, {{"words", printable(trim(reason), 200)}});
    return std::nullopt;
}

} // namespace

JobOutput::Line JobOutput::read(std::string_view line)
{
    if (line.starts_with(guard_prefix))
        return read_guard(line);
    if (line.starts_with(tar_prefix) && has_no_simulator()) {
        if (copy_trouble_.empty()) // what is before the last colon names files of this server
            copy_trouble_ = printable(line.substr(line.rfind(": ") + 2), 200);
        return Line::ours;
    }
    bool const is_of_srun = line.starts_with("srun: ");
    if (!is_of_srun && !line.starts_with("slurmstepd"))
        return Line::simulators;
    if (!node_.empty() || !is_of_srun) {
        if (auto reason = why_it_ends(line))
            return end(std::move(*reason));
        if (contains(line, "couldn't chdir to"))
            return end(refused(Refused::node_without_project));
        return Line::ours;
    }
    if (line.ends_with("queued and waiting for resources"))
        return Line::waits;
    if (auto reason = why_it_does_not_start(line))
        return end(std::move(*reason));
    return Line::ours;
}

JobOutput::Line JobOutput::read_guard(std::string_view line)
{
    auto const words = split(line, ' ');
    if (line == cannot_send && has_no_simulator())
        return end_without_project();
    // The first line of the guard on the node has the word that all its others are known by, as the simulator
    // can't know it.
    if (word_.empty()) {
        if (words.size() != 7 || words[2] != "runs")
            return Line::simulators;
        word_ = words[1];
        node_ = words[4];
        number_ = words[6];
        return Line::runs;
    }
    if (words.size() < 4 || words[1] != word_)
        return Line::simulators;
    auto const number = [&words](std::size_t at) {
        std::uint64_t value = 0;
        if (at < words.size())
            std::from_chars(words[at].data(), words[at].data() + words[at].size(), value);
        return value;
    };
    if (words[2] == "can't")
        return end_without_project();
    if (words[2] == "receives") {
        copies_ = true;
        usage_.received = number(3);
        return Line::receives;
    }
    if (words[2] == "listens") {
        port_ = static_cast<std::uint16_t>(number(4));
        return Line::listens;
    }
    // After the copy the guard has other things to say.
    copies_ = false;
    if (words[2] != "uses")
        return Line::ours;
    usage_.processor = std::chrono::milliseconds(number(3));
    usage_.memory = number(4);
    usage_.own_memory = number(5);
    usage_.processes = number(6);
    usage_.complete = number(7) != 0;
    usage_.disk = number(8);
    usage_.too_many_files = number(9) != 0;
    return Line::uses;
}

JobOutput::Line JobOutput::end_without_project()
{
    return end(copy_trouble_.empty()
                   ? refused(Refused::job_project_not_copied)
                   : refused(Refused::job_project_not_copied_saying, {{"words", copy_trouble_}}));
}

JobOutput::Line JobOutput::end(Failure reason)
{
    if (reason_.detail().empty()) // further lines only say that it is killed
        reason_ = std::move(reason);
    return Line::ends;
}

std::string copying_text(std::uint64_t received)
{
    auto const tenths = received / 100'000;
    return concat("Copying the project to its node of the cluster (", std::to_string(tenths / 10), ".",
                  std::to_string(tenths % 10), " MB)");
}

} // namespace webots_cloud::core
