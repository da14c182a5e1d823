#include "display_choice.hpp"

namespace webots_cloud::core {

DisplayChoice choose_display(DisplayContext const& context)
{
    using enum DisplayChoice::Kind;
    DisplayChoice choice;
    choice.is_configured = !context.configured.empty();
    if (context.configured == "none") {
        choice.kind = none;
    } else if (context.configured == "private") {
        choice.kind = own;
    } else {
        choice.name = choice.is_configured ? context.configured : context.display;
        choice.may_be_opened = !choice.name.empty() && context.ssh_connection.empty();
        if (choice.name.empty() && !context.has_screen && context.may_be_private)
            choice.kind = own;
    }
    return choice;
}

} // namespace webots_cloud::core
