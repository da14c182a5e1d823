// The unit of a service of systemd: with which user, folders and confinement the service runs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

struct ServiceUnit
{
    ServiceUnit() = default;

    /// `Name=value`, in their order, as `systemd-run --property` takes them: what the program finds around
    /// it, and not how it is started, watched and ended.
    std::vector<std::string> settings;
    std::string command;     ///< The last `ExecStart=`.
    bool pins_users = false; ///< Root makes users for its simulations before it starts.
};

/// `text`: what `systemctl cat` prints, with all drop-in files.   `name`: without `.service`.
ServiceUnit parse_service_unit(std::string_view text, std::string_view name);

} // namespace webots_cloud::core
