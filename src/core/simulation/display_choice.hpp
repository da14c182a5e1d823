// Which screen simulations draw on.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

struct DisplayChoice
{
    DisplayChoice() = default;

    std::string name; ///< As in `DISPLAY`; empty: nobody has named one.
    /// The server may let containers draw on it (`xhost`): it is a screen of this machine.
    bool may_be_opened = false;

    bool operator==(DisplayChoice const&) const = default;
};

/// `configured` is the key `display`, the others are the server's environment: `DISPLAY`, and
/// `SSH_CONNECTION`, which says that the server was started in a login over SSH. The screen then may be that
/// of another machine, which is not ours to open, whoever named it.
DisplayChoice choose_display(std::string_view configured, std::string_view display,
                             std::string_view ssh_connection);

} // namespace webots_cloud::core
