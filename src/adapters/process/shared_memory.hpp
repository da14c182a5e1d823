// Memory that processes hold beyond pages of their own: what they share, and files in memory.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <vector>

namespace webots_cloud::adapters {

/// All memory of this machine that is shared or holds files, in bytes, with what is in swap: no tree of
/// processes can have more of it. Reads one small file. Errors: more than any machine has.
std::uint64_t machine_shared_memory();

/// What processes hold of it.
struct SharedMemory
{
    std::uint64_t bytes = 0;
    bool is_whole = true; ///< False: there is more to be looked at than is reasonable.
};

/// Counts once, whichever of these processes have them: files in memory without a name (`memfd_create`,
/// deleted ones of `/dev/shm`), pages that are shared without a file, System V segments, as far as one of
/// them has these open or mapped; and file systems in memory that we do not see ourselves, with all that is
/// in them.
///
/// `processes`: a number of a living thread of each. Reads what they have open and mapped: not for the event
/// loop.
SharedMemory shared_memory(std::vector<pid_t> const& processes);

} // namespace webots_cloud::adapters
