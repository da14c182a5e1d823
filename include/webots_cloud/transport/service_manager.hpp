// The program that started us and watches over us (systemd, for instance), as a seam.
#pragma once

#include <webots_cloud/time.hpp>

#include <optional>
#include <string_view>

namespace webots_cloud {

/// Thread-safety: one executor.
class ServiceManager
{
public:
    virtual ~ServiceManager() = default;

    /// Tells it a state in the words of sd_notify(3), such as `READY=1`. Never blocks; one that can't be told
    /// is ignored.
    virtual void tell(std::string_view state) noexcept = 0;

    /// Within what time it wants a sign of life, again and again; nothing when it wants none.
    virtual std::optional<Duration> watchdog() const noexcept = 0;
};

} // namespace webots_cloud
