#include "adapters/operator/operator_socket.hpp"
#include "core/text.hpp"
#include "daemon.hpp"
#include "operator_requests.hpp"

#include <iostream>

namespace webots_cloud::app {

using core::concat;

int ask_running_server(Program const& program, Arguments const& arguments, std::uint16_t port,
                       AccessConfig const& access)
{
    auto const& command = *arguments.command;
    auto const path = find_operator_socket(program.kind, port, access);
    auto const answer = adapters::ask_operator_socket(path, command.method, command.target);
    if (answer) {
        std::cout << (command.table && !arguments.json ? command.table(*answer) : *answer) << std::endl;
        return exit_ok;
    }
    if (answer.error() == errc::unavailable) {
        std::cerr << terminal_text(concat(program.name, ": ", answer.error().message())) << std::endl;
        return exit_try_again;
    }
    // What the server has answered says all; else nobody has.
    auto const sentence =
        answer.error() == errc::invalid_argument
            ? answer.error().message()
            : concat("no answer at ", path.string(), ": ", answer.error().message(),
                     ". Does a server with this configuration run on this machine, as this user?");
    std::cerr << terminal_text(concat(program.name, ": ", sentence)) << std::endl;
    return exit_failed;
}

} // namespace webots_cloud::app
