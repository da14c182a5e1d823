// How long processes keep the graphics processors of this machine busy.
#pragma once

#include "nvml.hpp"

#include <webots_cloud/transport/host_metrics.hpp>

#include <memory>
#include <span>

namespace webots_cloud::adapters {

class MachineGraphics final : public GraphicsTimes
{
public:
    explicit MachineGraphics(std::shared_ptr<NvidiaGpus const> nvidia);

    Duration busy(std::span<int const> processes) const override;

    int count() const noexcept { return count_; } ///< Of graphics processors.

private:
    std::shared_ptr<NvidiaGpus const> nvidia_;
    int drm_devices_;
    int count_;
};

} // namespace webots_cloud::adapters
