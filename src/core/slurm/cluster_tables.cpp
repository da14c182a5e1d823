// The arguments for Slurm's programs and the meaning of what they print. Other users choose the names of
// their jobs, so rows are believed only where they can't be forged.
#include "cluster_tables.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::core {
namespace {

// A job that waits for a resource nobody gives back in time has an estimate of a year.
constexpr auto longest_estimate = std::chrono::hours(24 * 30);

std::uint64_t whole_number(std::string_view text)
{
    std::uint64_t number = 0;
    std::from_chars(text.data(), text.data() + text.size(), number);
    return number;
}

/// `17`, or `17_3` of an array.
bool is_job_number(std::string_view text)
{
    return !text.empty() && text.front() != '_' &&
           text.find_first_not_of("0123456789_") == std::string_view::npos;
}

std::vector<std::string_view> words_of(std::string_view line)
{
    auto words = split(line, ' ');
    std::erase_if(words, [](std::string_view word) { return word.empty(); });
    return words;
}

std::string only_of(std::vector<std::string> const& partitions)
{
    return concat("--partition=", join({partitions.begin(), partitions.end()}, ","));
}

/// What explains itself, as Slurm's usual reasons to wait do, is not told.
std::string text_of_reason(std::string_view reason)
{
    for (std::string_view const usual : {"", "None", "Resources", "Priority", "BeginTime"})
        if (reason == usual)
            return {};
    return concat(" Slurm's reason: ", printable(reason, 60), ".");
}

} // namespace

std::vector<std::string> queue_arguments(std::vector<std::string> const& partitions)
{
    return {"--noheader", "--sort=-p,i", "--states=PENDING,CONFIGURING,RUNNING,SUSPENDED,COMPLETING",
            "--format=%i|%T|%r|%S|%j", only_of(partitions)};
}

std::vector<std::string> own_queue_arguments(std::vector<std::string> const& partitions)
{
    auto arguments = queue_arguments(partitions);
    arguments.insert(arguments.begin(), "--me");
    return arguments;
}

std::vector<std::string> cancel_arguments(std::vector<std::string> jobs)
{
    jobs.insert(jobs.begin(), "--"); // whatever follows is no option
    return jobs;
}

std::vector<QueuedJob> parse_queue(std::string_view printed)
{
    std::vector<QueuedJob> jobs;
    for (auto const line : split(printed, '\n')) {
        auto const fields = split(line, '|');
        constexpr std::size_t before_name = 4;
        if (fields.size() <= before_name || !is_job_number(fields[0]))
            continue;
        auto& job = jobs.emplace_back();
        job.id = fields[0];
        job.waits = fields[1] == "PENDING";
        job.ends = fields[1] == "COMPLETING";
        job.reason = fields[2];
        if (auto const start = whole_number(fields[3]); start > 0)
            job.start = WallTime(std::chrono::seconds(start));
        // The rest, since names of others may have such a sign in them.
        job.name = line.substr(static_cast<std::size_t>(fields[before_name].data() - line.data()));
    }
    return jobs;
}

std::string waiting_text(std::vector<QueuedJob> const& queue, std::string_view name, WallTime now)
{
    std::size_t waiting = 0;
    std::size_t position = 0;
    QueuedJob const* own = nullptr;
    for (auto const& job : queue) {
        if (!job.waits)
            continue;
        ++waiting;
        if (job.name == name) {
            own = &job;
            position = waiting;
        }
    }
    if (!own)
        return {};
    auto text = concat("Waiting for a free node of the cluster: position ", std::to_string(position), " of ",
                       std::to_string(waiting), ".");
    if (own->start && *own->start > now && *own->start - now < longest_estimate)
        text += concat(" Slurm expects the start in ",
                       age_text(std::chrono::duration_cast<Duration>(*own->start - now)), ".");
    return text + text_of_reason(own->reason);
}

std::vector<std::string> strangers(std::vector<QueuedJob> const& queue, std::string_view identity,
                                   std::vector<std::string> const& known)
{
    std::vector<std::string> found;
    for (auto const& job : queue)
        if (job.name.starts_with(identity) && !job.ends && std::ranges::find(known, job.name) == known.end())
            found.push_back(job.id);
    return found;
}

std::vector<std::string> partition_arguments()
{
    return {"--noheader", "--format=%P"};
}

ClusterPartitions parse_partitions(std::string_view printed)
{
    ClusterPartitions partitions;
    for (auto const line : split(printed, '\n')) {
        auto name = trim(line);
        bool const is_standard = name.ends_with('*');
        if (is_standard)
            name.remove_suffix(1);
        if (name.empty())
            continue;
        partitions.names.emplace_back(name);
        if (is_standard)
            partitions.standard = name;
    }
    return partitions;
}

std::vector<std::string> node_arguments(std::vector<std::string> const& partitions)
{
    return {"--noheader", "--Node", "--Format=NodeList:200,NodeAddr:200,CPUsState:60,Memory:30,AllocMem:30",
            only_of(partitions)};
}

std::vector<ClusterNode> parse_nodes(std::string_view printed)
{
    std::vector<ClusterNode> nodes;
    for (auto const line : split(printed, '\n')) {
        auto const words = words_of(line);
        if (words.size() != 5)
            continue;
        auto const is_it = [&words](ClusterNode const& node) { return node.name == words[0]; };
        if (std::ranges::any_of(nodes, is_it))
            continue;
        auto const processors = split(words[2], '/'); // allocated, idle, other, total
        if (processors.size() != 4)
            continue;
        auto& node = nodes.emplace_back();
        node.name = words[0];
        node.address = words[1];
        node.allocated = whole_number(processors[0]);
        node.idle = whole_number(processors[1]);
        node.memory = whole_number(words[3]);
        node.allocated_memory = whole_number(words[4]);
    }
    return nodes;
}

ClusterLoad load_of_nodes(std::vector<ClusterNode> const& nodes)
{
    ClusterLoad load;
    std::uint64_t allocated_memory = 0;
    for (auto const& node : nodes) {
        load.allocated += node.allocated;
        load.processors += node.allocated + node.idle;
        if (node.allocated + node.idle > 0) {
            load.memory += node.memory;
            allocated_memory += node.allocated_memory;
        }
    }
    if (load.memory > 0)
        load.memory_used = 100 * static_cast<double>(allocated_memory) / static_cast<double>(load.memory);
    return load;
}

} // namespace webots_cloud::core
