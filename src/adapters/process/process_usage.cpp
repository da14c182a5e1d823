#include "process_usage.hpp"

#include "process_tree.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {
namespace {

// Where proc(5) has the fields of /proc/<pid>/stat, counted from the one after the name.
constexpr int utime_field = 11;
constexpr int cstime_field = 14;
constexpr int threads_field = 17;
constexpr int resident_field = 21;

struct Ticks
{
    long long processor = 0;
    long long pages = 0;
    long long threads = 0;
};

Ticks read_process(pid_t process)
{
    ProcBuffer buffer;
    auto text = read_start("/proc/" + std::to_string(process) + "/stat", buffer);
    auto const name_end = text.rfind(')'); // the name may hold anything, parentheses and blanks too
    Ticks ticks;
    if (name_end == std::string_view::npos || name_end + 3 > text.size())
        return ticks;
    text.remove_prefix(name_end + 3); // a blank, and the state: a letter
    for (int field = 1; field <= resident_field; ++field) {
        auto const value = next_number(text);
        // Of children too that ended and were waited for: so nothing is lost when a process of the tree ends.
        if (field >= utime_field && field <= cstime_field)
            ticks.processor += value;
        if (field == threads_field)
            ticks.threads = value;
        if (field == resident_field)
            ticks.pages = value;
    }
    return ticks;
}

/// Pages of a process that are of no file.
long long own_pages(pid_t process)
{
    ProcBuffer buffer;
    auto text = read_start("/proc/" + std::to_string(process) + "/statm", buffer);
    next_number(text); // all of them, used or not
    auto const resident = next_number(text);
    return std::max(0LL, resident - next_number(text));
}

/// The same in bytes, with a fair part of each page that it shares with others. Takes longer.
/// Returns: nothing when that can't be read.
std::optional<std::uint64_t> own_share(pid_t process)
{
    constexpr std::string_view name = "Pss_Anon:";
    ProcBuffer buffer;
    auto text = read_start("/proc/" + std::to_string(process) + "/smaps_rollup", buffer);
    auto const found = text.find(name);
    if (found == std::string_view::npos)
        return std::nullopt;
    text.remove_prefix(found + name.size());
    return static_cast<std::uint64_t>(next_number(text)) << 10;
}

} // namespace

ProcessUsage process_usage(pid_t root, std::size_t max_processes, std::uint64_t enough_memory,
                           GraphicsTimes const* graphics)
{
    static long const ticks_per_second = ::sysconf(_SC_CLK_TCK);
    static long const page_size = ::sysconf(_SC_PAGESIZE);
    Ticks total;
    std::uint64_t own = 0;
    auto const tree = process_tree(root, max_processes);
    for (auto const process : tree.processes) {
        auto const ticks = read_process(process);
        total.processor += ticks.processor;
        total.pages += ticks.pages;
        total.threads += ticks.threads;
        own += static_cast<std::uint64_t>(own_pages(process) * page_size);
    }
    if (own > enough_memory) { // counting pages as often as forked processes share them
        own = 0;
        for (auto const process : tree.processes)
            own += own_share(process).value_or(static_cast<std::uint64_t>(own_pages(process) * page_size));
    }
    auto const processor = std::chrono::duration<double>(static_cast<double>(total.processor) /
                                                         static_cast<double>(ticks_per_second));
    ProcessUsage usage(std::chrono::duration_cast<Duration>(processor),
                       static_cast<std::uint64_t>(total.pages * page_size));
    usage.own_memory_bytes = own;
    usage.processes = static_cast<std::uint64_t>(total.threads);
    if (graphics)
        usage.graphics = graphics->busy(tree.processes);
    usage.complete = tree.is_whole;
    return usage;
}

} // namespace webots_cloud::adapters
