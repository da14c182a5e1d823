// Graphics processors of NVIDIA, asked through the library that their driver brings.
#pragma once

#include <webots_cloud/transport/host_metrics.hpp>

#include <memory>
#include <optional>
#include <string>

namespace webots_cloud::adapters {

/// Looks once a second, on a thread of its own: a driver may take its time. Nothing is linked; without the
/// library there are none.
///
/// Thread-safety: one thread.
class NvidiaGpus
{
public:
    /// `library` is a path, or a name that the loader finds. Waits for the first look, for three seconds at
    /// most.
    explicit NvidiaGpus(std::string const& library);
    ~NvidiaGpus();
    NvidiaGpus(NvidiaGpus const&) = delete;
    NvidiaGpus& operator=(NvidiaGpus const&) = delete;

    /// The latest look: of several processors, the highest of each figure. Nothing where there is none.
    std::optional<GpuSample> sample() const;

    /// As `HostDescription::gpu`.
    std::string description() const;

private:
    struct Shared;
    std::shared_ptr<Shared> shared_; ///< With the thread, which may outlive us while the driver hangs.
};

} // namespace webots_cloud::adapters
