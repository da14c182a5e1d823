#include "process_inspection.hpp"

#include "listening_ports.hpp"
#include "orphans.hpp"
#include "process_usage.hpp"

namespace webots_cloud::adapters {
namespace {

/// `end_writers`, for a thread that may wait.
struct EndWriters
{
    bool operator()() const
    {
        end_writers(pipe);
        return true;
    }

    ino_t pipe;
};

} // namespace

std::uint16_t FindPort::operator()() const
{
    if (relayed == 0)
        return listening_port(root, first, last);
    bool const listens = broker.empty() ? has_listener(relayed) : has_listener(broker);
    return listens ? relayed : std::uint16_t{0};
}

ProcessUsage TakeUsage::operator()() const
{
    auto usage = process_usage(root, max_processes, enough_memory, graphics.get());
    if (!group)
        return usage;
    auto const counted = ControlGroups::usage(group->group);
    if (group->group.memory > 0) { // what is over the limit of memory, the kernel kills
        usage.memory_bytes = counted.memory_bytes;
        usage.own_memory_bytes = 0;
    }
    if (group->group.processes > 0)
        usage.processes = counted.processes;
    if (group->group.processors > 0)
        usage.processor = counted.processor;
    usage.memory_kills = counted.memory_kills;
    usage.refused_forks = counted.refused_forks;
    usage.complete = usage.complete || (group->group.memory > 0 && group->group.processors > 0);
    return usage;
}

ProcessUsage TakeRefusals::operator()()
{
    auto const counted = ControlGroups::usage(group->group);
    ProcessUsage usage;
    usage.memory_kills = counted.memory_kills;
    usage.refused_forks = counted.refused_forks;
    group.reset();
    return usage;
}

boost::asio::awaitable<std::uint16_t> find_port(std::shared_ptr<InspectionThreads> inspection, FindPort work)
{
    co_return co_await inspection->ports.run(work);
}

boost::asio::awaitable<ProcessUsage> take_usage(std::shared_ptr<InspectionThreads> inspection, TakeUsage work)
{
    if (work.has_limits)
        co_return co_await inspection->limits.run(work);
    co_return co_await inspection->usage.run(work);
}

boost::asio::awaitable<void> end_writers_aside(std::shared_ptr<InspectionThreads> inspection, ino_t pipe)
{
    EndWriters work{pipe};
    (void)co_await inspection->limits.run(work);
}

} // namespace webots_cloud::adapters
