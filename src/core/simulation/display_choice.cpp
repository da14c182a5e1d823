#include "display_choice.hpp"

namespace webots_cloud::core {

DisplayChoice choose_display(std::string_view configured, std::string_view display,
                             std::string_view ssh_connection)
{
    DisplayChoice choice;
    choice.name = configured.empty() ? display : configured;
    choice.may_be_opened = !choice.name.empty() && ssh_connection.empty();
    return choice;
}

} // namespace webots_cloud::core
