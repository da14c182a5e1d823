// Graphics processors of NVIDIA, queried through the library of their driver.
#pragma once

#include <webots_cloud/transport/host_metrics.hpp>

#include <memory>
#include <optional>
#include <span>
#include <string>

namespace webots_cloud::adapters {

/// Samples once a second, on a thread of its own, because a driver may be slow. The library is loaded at run
/// time; without it there are none.
///
/// Thread-safety: all threads.
class NvidiaGpus
{
public:
    /// `library` is a path, or a name that the loader finds. Waits for the first sample, for three seconds at
    /// most.
    explicit NvidiaGpus(std::string const& library);
    ~NvidiaGpus();
    NvidiaGpus(NvidiaGpus const&) = delete;
    NvidiaGpus& operator=(NvidiaGpus const&) = delete;

    /// The latest sample: of several processors, the highest of each figure. Nothing where there is none.
    std::optional<GpuSample> sample() const;

    /// As `HostDescription::gpu`.
    std::string description() const;

    int count() const; ///< Of graphics processors.

    /// As `GraphicsTimes::busy`. Drivers that are too old to tell (before 367) count as 0.
    Duration busy(std::span<int const> processes) const;

private:
    struct Shared;
    std::shared_ptr<Shared> shared_; ///< With the thread, which may outlive us while the driver hangs.
};

} // namespace webots_cloud::adapters
