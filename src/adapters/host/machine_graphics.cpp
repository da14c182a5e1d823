#include "machine_graphics.hpp"

#include "drm_clients.hpp"

#include <utility>

namespace webots_cloud::adapters {

MachineGraphics::MachineGraphics(std::shared_ptr<NvidiaGpus const> nvidia)
    : nvidia_(std::move(nvidia)), drm_devices_(count_drm_devices("/dev/dri")),
      // NVIDIA's driver has files in that folder too, but tells nobody there how they are used.
      count_(nvidia_->count() > 0 ? nvidia_->count() : drm_devices_)
{}

Duration MachineGraphics::busy(std::span<int const> processes) const
{
    auto const drm = drm_devices_ > 0 ? drm_time("/proc", processes) : Duration();
    return drm + nvidia_->busy(processes);
}

} // namespace webots_cloud::adapters
