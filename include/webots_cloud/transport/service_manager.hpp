// The service manager that started us (systemd, for instance), as a seam.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <optional>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Thread-safety: one executor.
class ServiceManager
{
public:
    virtual ~ServiceManager() = default;

    /// Reports a state in the format of sd_notify(3), such as `READY=1`. Never blocks; failures are ignored.
    virtual void tell(std::string_view state) noexcept = 0;

    /// The interval of its watchdog, within which it expects a keep-alive message; nothing when it has none.
    virtual std::optional<Duration> watchdog() const noexcept = 0;
};

} // namespace webots_cloud
