// Walks a tree of processes in proc(5). The cheap figure is used as long as it is far from the limit; near
// it, what processes share is counted exactly (shared_memory.cpp).
#include "process_usage.hpp"

#include "process_tree.hpp"
#include "shared_memory.hpp"

#include <dirent.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
    bool lost_first_thread = false; ///< It has ended, the others go on.
};

Ticks read_process(pid_t process)
{
    ProcBuffer buffer;
    auto text = read_start("/proc/" + std::to_string(process) + "/stat", buffer);
    auto const name_end = text.rfind(')'); // the name may hold anything, parentheses and blanks too
    Ticks ticks;
    if (name_end == std::string_view::npos || name_end + 3 > text.size())
        return ticks;
    bool const has_ended = text[name_end + 2] == 'Z';
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
    ticks.lost_first_thread = has_ended && ticks.threads > 1;
    return ticks;
}

/// What is in memory of a process, in pages; of that, what is of no file.
struct Pages
{
    long long all = 0;
    long long own = 0;
};

Pages read_pages(pid_t process)
{
    ProcBuffer buffer;
    auto text = read_start("/proc/" + std::to_string(process) + "/statm", buffer);
    next_number(text); // all of them, used or not
    Pages pages;
    pages.all = next_number(text);
    pages.own = std::max(0LL, pages.all - next_number(text));
    return pages;
}

/// The kernel shows nothing of the memory of a process by a thread that has ended, such as the first one.
/// Returns: the number of another one; that of the process, if there is none.
pid_t thread_with_memory(pid_t process)
{
    auto const tasks = "/proc/" + std::to_string(process) + "/task";
    std::unique_ptr<DIR, int (*)(DIR*)> const listing(::opendir(tasks.c_str()), &::closedir);
    while (auto const* const entry = listing ? ::readdir(listing.get()) : nullptr) {
        std::string_view const name(entry->d_name);
        pid_t thread = 0;
        std::from_chars(name.data(), name.data() + name.size(), thread);
        if (thread > 0 && read_pages(thread).all > 0)
            return thread;
    }
    return process;
}

/// The number behind `key` in a table of the kernel's that says kB, in bytes.
std::optional<std::uint64_t> bytes_of(std::string_view text, std::string_view key)
{
    auto const found = text.find(key);
    if (found == std::string_view::npos)
        return std::nullopt;
    text.remove_prefix(found + key.size());
    return static_cast<std::uint64_t>(next_number(text)) << 10;
}

std::uint64_t own_bytes(pid_t process)
{
    static auto const page_size = static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
    return static_cast<std::uint64_t>(read_pages(process).own) * page_size;
}

/// Memory of a process that is of no file, in bytes: also what is in swap, and the tables of its pages, which
/// can be larger than these.
std::uint64_t own_memory(pid_t process)
{
    ProcBuffer buffer;
    auto const text = read_start("/proc/" + std::to_string(process) + "/status", buffer);
    auto const resident = bytes_of(text, "\nRssAnon:\t");
    if (!resident) // very many groups, which come before, leave no room for it
        return own_bytes(process);
    return *resident + bytes_of(text, "\nVmSwap:\t").value_or(0) + bytes_of(text, "\nVmPTE:\t").value_or(0);
}

/// The same with a fair part of each page that it shares with others. Takes longer.
std::uint64_t own_share(pid_t process)
{
    auto const id = std::to_string(process);
    ProcBuffer rollup_buffer;
    auto const rollup = read_start("/proc/" + id + "/smaps_rollup", rollup_buffer);
    auto const share = bytes_of(rollup, "\nPss_Anon:");
    if (!share)
        return own_memory(process);
    ProcBuffer buffer;
    auto const status = read_start("/proc/" + id + "/status", buffer);
    return *share + bytes_of(rollup, "\nSwapPss:").value_or(0) + bytes_of(status, "\nVmPTE:\t").value_or(0);
}

/// What counts towards the limit `enough`. Most simulations are so far from it that what is quickly read
/// shows that.
std::uint64_t counted_memory(std::vector<pid_t> const& processes, std::uint64_t enough)
{
    // Three looks, each slower than the one before, and only where that could not tell that it is little.
    std::uint64_t own = 0;
    for (auto const process : processes)
        own += own_memory(process);
    auto const all = machine_shared_memory();
    if (own <= enough && all <= enough - own)
        return own;
    auto const found = shared_memory(processes);
    auto const shared = found.is_whole ? found.bytes : all;
    if (own <= enough && shared <= enough - own)
        return own + shared;
    own = 0; // which counted pages as often as forked processes share them
    for (auto const process : processes)
        own += own_share(process);
    return own + std::min(shared, ~own);
}

} // namespace

ProcessUsage process_usage(pid_t root, std::size_t max_processes, std::uint64_t enough_memory,
                           GraphicsTimes const* graphics)
{
    static long const ticks_per_second = ::sysconf(_SC_CLK_TCK);
    static long const page_size = ::sysconf(_SC_PAGESIZE);
    Ticks total;
    auto const tree = process_tree(root, max_processes);
    std::vector<pid_t> holders; // of memory
    holders.reserve(tree.processes.size());
    for (auto const process : tree.processes) {
        auto const ticks = read_process(process);
        total.processor += ticks.processor;
        total.threads += ticks.threads;
        holders.push_back(ticks.lost_first_thread ? thread_with_memory(process) : process);
        total.pages += ticks.lost_first_thread ? read_pages(holders.back()).all : ticks.pages;
    }
    auto const processor = std::chrono::duration<double>(static_cast<double>(total.processor) /
                                                         static_cast<double>(ticks_per_second));
    ProcessUsage usage(std::chrono::duration_cast<Duration>(processor),
                       static_cast<std::uint64_t>(total.pages * page_size));
    usage.own_memory_bytes = counted_memory(holders, enough_memory);
    usage.processes = static_cast<std::uint64_t>(total.threads);
    if (graphics)
        usage.graphics = graphics->busy(tree.processes);
    usage.complete = tree.is_whole;
    return usage;
}

} // namespace webots_cloud::adapters
