// Which screen simulations draw on.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// What the choice depends on.
struct DisplayContext
{
    DisplayContext() = default;

    std::string configured; ///< The key `display`: a display, `private` or `none`; empty: it is missing.
    std::string display;    ///< `DISPLAY` of the server's environment.
    /// `SSH_CONNECTION`, which says that the server was started in a login over SSH. The screen then may be
    /// that of another machine, which is not ours to open, whoever named it.
    std::string ssh_connection;
    bool has_screen = false;     ///< There is an X server at `:0`.
    bool may_be_private = false; ///< Xvfb is installed, and simulators are no containers.
};

struct DisplayChoice
{
    DisplayChoice() = default;

    enum class Kind
    {
        shared, ///< All draw on the X server `name`.
        own,    ///< Each has a virtual X server of its own.
        none,
    };

    Kind kind = Kind::shared;
    std::string name; ///< As in `DISPLAY`; empty: nobody has named one.
    /// The server may let containers draw on it (`xhost`): it is a screen of this machine.
    bool may_be_opened = false;
    bool is_configured = false; ///< The operator has asked for it; otherwise it is what seems best here.

    bool operator==(DisplayChoice const&) const = default;
};

DisplayChoice choose_display(DisplayContext const& context);

} // namespace webots_cloud::core
