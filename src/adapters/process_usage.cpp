#include "process_usage.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {
namespace {

// Where proc(5) has the fields of /proc/<pid>/stat, counted from the one after the name.
constexpr int utime_field = 11;
constexpr int cstime_field = 14;
constexpr int resident_field = 21;

/// The start of a small file of the kernel, in one read.
std::string_view read_start(std::string const& path, std::array<char, 4096>& buffer)
{
    int const file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return {};
    auto const size = ::read(file, buffer.data(), buffer.size());
    ::close(file);
    return {buffer.data(), size > 0 ? static_cast<std::size_t>(size) : 0};
}

/// Cuts the next number off a list that is separated by blanks.
long long next_number(std::string_view& list)
{
    long long value = 0;
    auto const start = list.find_first_not_of(' ');
    list.remove_prefix(start == std::string_view::npos ? list.size() : start);
    auto const [end, error] = std::from_chars(list.data(), list.data() + list.size(), value);
    list.remove_prefix(static_cast<std::size_t>(end - list.data()));
    return value;
}

struct Ticks
{
    long long processor = 0;
    long long pages = 0;
};

Ticks read_process(pid_t process)
{
    std::array<char, 4096> buffer;
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
        if (field == resident_field)
            ticks.pages = value;
    }
    return ticks;
}

void add_children(pid_t parent, std::vector<pid_t>& tree)
{
    std::array<char, 4096> buffer;
    auto const id = std::to_string(parent);
    auto list = read_start("/proc/" + id + "/task/" + id + "/children", buffer);
    while (auto const child = next_number(list))
        tree.push_back(static_cast<pid_t>(child));
}

} // namespace

ProcessUsage process_usage(pid_t root)
{
    static long const ticks_per_second = ::sysconf(_SC_CLK_TCK);
    static long const page_size = ::sysconf(_SC_PAGESIZE);
    Ticks total;
    std::vector<pid_t> tree{root};
    for (std::size_t i = 0; i < tree.size(); ++i) {
        auto const ticks = read_process(tree[i]);
        total.processor += ticks.processor;
        total.pages += ticks.pages;
        add_children(tree[i], tree);
    }
    auto const processor = std::chrono::duration<double>(static_cast<double>(total.processor) /
                                                         static_cast<double>(ticks_per_second));
    return {std::chrono::duration_cast<Duration>(processor),
            static_cast<std::uint64_t>(total.pages * page_size)};
}

} // namespace webots_cloud::adapters
