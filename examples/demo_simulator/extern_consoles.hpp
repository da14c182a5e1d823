// Controllers that somebody else starts (`controller "<extern>"`), as far as their consoles go. Each robot
// that has one gets a socket where Webots has it, `/tmp/webots/<user>/<port>/ipc/<robot>/extern`; a
// controller writes what it prints there, as plain lines, which is not Webots' protocol.
#pragma once

#include <boost/asio/io_context.hpp>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace webots_cloud::demo {

class ExternConsoles
{
public:
    /// `say` gets each line that a controller prints.
    ExternConsoles(boost::asio::io_context& context, std::function<void(std::string const&)> say);
    ~ExternConsoles();

    /// For these robots, of the simulator that listens on `port`. A socket that can't be made is told on
    /// stdout.
    void open(std::vector<std::string> const& robots, unsigned short port);

private:
    class Console;

    boost::asio::io_context& context_;
    std::function<void(std::string const&)> say_;
    std::vector<std::unique_ptr<Console>> consoles_;
};

} // namespace webots_cloud::demo
