#include "own_limits.hpp"

#include "core/text.hpp"

#include <limits>
#include <string>

#include <sys/resource.h>

namespace webots_cloud::app {
namespace {

using core::concat;

constexpr std::uint64_t kilobyte = 1024; // as `ulimit` counts
constexpr std::uint64_t megabyte = 1024 * kilobyte;
constexpr std::uint64_t fewest_descriptors = 64;          // those of a server and of its first simulations
constexpr std::uint64_t smallest_file = 32 * megabyte;    // much more than a log has before it is set aside
constexpr std::uint64_t smallest_memory = 128 * megabyte; // a session server that has just started takes 110

std::uint64_t in_bytes(rlim_t limit)
{
    return limit == RLIM_INFINITY ? std::numeric_limits<std::uint64_t>::max() : limit;
}

rlimit limit_of(__rlimit_resource_t resource)
{
    rlimit limit{RLIM_INFINITY, RLIM_INFINITY};
    ::getrlimit(resource, &limit);
    return limit;
}

Failure too_little(std::string const& what, std::string const& remedy)
{
    return {errc::unavailable, concat(what, ". ", remedy,
                                      " before the start; a limit that only root can raise is in "
                                      "/etc/security/limits.conf, or in the unit of a service")};
}

} // namespace

OwnLimits own_limits()
{
    OwnLimits limits;
    limits.descriptors = in_bytes(limit_of(RLIMIT_NOFILE).rlim_max);
    limits.file_size = in_bytes(limit_of(RLIMIT_FSIZE).rlim_cur);
    limits.memory = in_bytes(limit_of(RLIMIT_AS).rlim_cur);
    return limits;
}

result<> check_limits(OwnLimits const& limits)
{
    if (limits.descriptors < fewest_descriptors)
        return too_little(concat("A server needs ", std::to_string(fewest_descriptors),
                                 " open files at least, and may have ", std::to_string(limits.descriptors)),
                          "Use ulimit -n 65536");
    if (limits.file_size < smallest_file)
        return too_little(concat("The logs of a server can't be written, because each file may have ",
                                 std::to_string(limits.file_size / kilobyte), " kB at most"),
                          "Use ulimit -f unlimited");
    if (limits.memory < smallest_memory)
        return too_little(concat("A server needs ", std::to_string(smallest_memory / megabyte),
                                 " MB of address space at least, and may have ",
                                 std::to_string(limits.memory / megabyte), " MB"),
                          "Use ulimit -v unlimited");
    return {};
}

} // namespace webots_cloud::app
