// The descendants of a process, from proc(5), with a limit on the work.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// A process and its descendants, the nearest first, at most `max` of them.
struct ProcessTree
{
    std::vector<pid_t> processes; ///< The first is the root.
    bool is_whole = true;         ///< False: there are more.
};

ProcessTree process_tree(pid_t root, std::size_t max);

using ProcBuffer = std::array<char, 4096>;

/// The start of a small file of the kernel, in one read.
std::string_view read_start(std::string const& path, ProcBuffer& buffer);

/// Removes the next number from a list that is separated by blanks; 0: there is none.
long long next_number(std::string_view& list);

} // namespace webots_cloud::adapters
