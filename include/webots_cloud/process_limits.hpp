// How much of the machine a program may use, together with everything that it starts.
#pragma once

#include <webots_cloud/export.hpp>

#include <cstdint>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// 0 everywhere: no limit.
struct ProcessLimits
{
    ProcessLimits() = default;

    std::uint64_t memory = 0;    ///< Bytes, of all processes together.
    double processors = 0;       ///< How many may be busy.
    std::uint64_t processes = 0; ///< Threads count as well, as they do for the kernel.
    std::uint64_t files = 0;     ///< That each process may have open.
    std::uint64_t disk = 0;      ///< Bytes, of all files in the instance directory.

    bool any() const noexcept { return memory || processors > 0 || processes || files || disk; }

    bool operator==(ProcessLimits const&) const = default;
};

/// What control groups keep on this machine. What they do not, is watched, or limited for each process.
struct LimitSupport
{
    LimitSupport() = default;

    bool memory = false;
    bool processes = false;
    bool processors = false;
    int version = 0;     ///< Of the control groups, 1 or 2; 0: there are none that may be used.
    std::string problem; ///< Why something is missing, as "/sys/fs/cgroup can't be written".
};

/// A limit that can be overrun.
enum class Limit
{
    memory,
    processes,
    disk,
    build ///< Of the disk as well, by the images that are built for a simulation.
};

/// What a simulation has made outside of its folder, in bytes.
struct WrittenElsewhere
{
    WrittenElsewhere() = default;

    std::uint64_t files = 0;  ///< In the file systems and volumes of its containers.
    std::uint64_t images = 0; ///< By all steps of its build together, those of earlier builds among them.
};

} // namespace webots_cloud
