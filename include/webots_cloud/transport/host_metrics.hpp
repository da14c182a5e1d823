// The state of the machine as a seam.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Graphics processors; if there are several, the highest of each figure. All in percent.
struct GpuSample
{
    GpuSample() = default;

    double compute = 0;
    double memory_controller = 0;
    double memory_used = 0;

    bool operator==(GpuSample const&) const = default;
};

/// One sample of the machine. Counters only grow; a load is the difference of two samples.
struct HostSample
{
    HostSample() = default;

    std::uint64_t cpu_busy = 0;  ///< Ticks of all processors that were not idle, since boot.
    std::uint64_t cpu_total = 0; ///< Ticks of all processors, since boot.
    /// The same for the share that a control group allows us, in microseconds; both 0 when it allows all
    /// processors.
    std::uint64_t share_busy = 0;
    std::uint64_t share_total = 0;
    double memory_used = 0; ///< Percent of the machine's or of the control groups' limit: the higher one.
    double swap_used = 0;   ///< Percent; 0 without swap.
    double disk_used = 0;   ///< Percent of the root file system.
    std::uint64_t bytes_sent = 0; ///< Over all interfaces but loopback, since boot.
    std::uint64_t bytes_received = 0;
    std::optional<GpuSample> gpu; ///< Absent on a machine without a graphics processor that can be asked.

    bool operator==(HostSample const&) const = default;
};

/// A description of the machine; does not change.
struct HostDescription
{
    HostDescription() = default;

    std::string system;    ///< For instance "Debian GNU/Linux 12 (bookworm)".
    std::string name;      ///< Host name.
    std::string processor; ///< Model.
    int cores = 0;         ///< As the operating system counts them: threads of the processor.
    int threads_per_core = 1;
    std::uint64_t memory_bytes = 0;
    std::string gpu; ///< Models, each with its memory, such as "2x NVIDIA T4 (15.8GB)"; or empty.
    /// Whose use by single processes is known.
    int graphics_processors = 0;
};

/// How long processes have kept graphics processors busy.
/// Thread-safety: all threads.
class GraphicsTimes
{
public:
    virtual ~GraphicsTimes() = default;

    /// All of these together, which may be the processes of one tree. It grows, but forgets processes that
    /// have ended, and those of which nothing was heard for a minute.
    virtual Duration busy(std::span<int const> processes) const = 0;
};

/// Samples the machine. Neither call blocks for longer than reading some small files of the kernel takes.
class HostMetrics
{
public:
    virtual ~HostMetrics() = default;
    virtual HostSample sample() = 0;
    virtual HostDescription description() = 0;
    /// Null: nothing is known of single processes.
    virtual std::shared_ptr<GraphicsTimes const> graphics_times() { return nullptr; }
};

} // namespace webots_cloud
