// Unpacks untrusted zip files with libarchive.
#pragma once

#include "fetch_budget.hpp"
#include "fetch_interrupt.hpp"

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <sys/types.h>
#include <vector>

namespace webots_cloud::adapters {

struct UnpackLimits
{
    std::uint32_t entries = 50'000; ///< With the folders that entries are in, whether or not they are named.
    std::uint64_t bytes = std::uint64_t{2} << 30; ///< Unpacked.
    /// Unpacked bytes for each byte of the archive. Texts of worlds shrink to a twentieth, a bomb to a
    /// thousandth.
    std::uint64_t growth = 200;
    std::uint64_t free_growth = std::uint64_t{64} << 20; ///< Unpacked bytes that are no bomb in any case.
    FetchShare* share =
        nullptr; ///< Budget for memory and disk; null: not counted.   Lifetime: outlives the call.
};

/// Unpacks the zip in the open file `archive`, from its beginning, into the open folder `root`, over what is
/// there: files are replaced. Nothing but files and folders is made, and nothing outside of `root`. Returns
/// what is left out since its name could do harm, as in `FetchedProject::forbidden`. Blocks.
///
/// Errors: `protocol_error` (no zip, damaged, encrypted, a name twice, links, devices), `too_large`,
/// `unavailable` (disk), and the interrupt's; the detail is a sentence. What was unpacked before stays.
result<std::vector<std::string>> unpack_zip(int archive, int root, UnpackLimits const& limits,
                                            FetchInterrupt const& interrupt = {});

/// Gives `mode` to everything below `root` that may be run, as controllers without a known extension need:
/// `unpack_zip` makes all files 0644. Blocks.
///
/// Precondition: there are no links.   Errors: `unavailable` (disk).
result<> make_runnable(std::filesystem::path const& root, mode_t mode);

} // namespace webots_cloud::adapters
