// What a shell, or a service manager, lets this program have (`ulimit`), and whether a server can work with
// that.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <cstdint>

namespace webots_cloud::app {

/// Of one simulation: pipes, the guard, and what fetching a project needs.
inline constexpr std::size_t descriptors_per_simulation = 8;

struct OwnLimits
{
    std::uint64_t descriptors = 0; ///< As many as it may allow itself (the hard limit).
    std::uint64_t file_size = 0;   ///< Bytes of each file that it writes.
    std::uint64_t memory = 0;      ///< Bytes of its address space.
};

OwnLimits own_limits();

/// Errors: `unavailable`: a server would end, or hear nothing; which limit it is, and what to do.
result<> check_limits(OwnLimits const& limits);

} // namespace webots_cloud::app
