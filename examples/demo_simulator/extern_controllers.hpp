// Controllers that connect over TCP (`CTR`), from this machine or another one. The greeting and its answers
// are Webots'. What follows is not: a controller says lines of text, each of which is sent back and appears
// in the browsers' consoles; `cruise <radians per second>` is how fast its robot drives on a free way.
#pragma once

#include "connection.hpp"

#include <boost/asio/ip/tcp.hpp>

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::demo {

/// Which robot a controller has, and what it is answered.
struct ControllerAnswer
{
    std::string text;
    std::string robot; ///< Empty: it was not connected.
};

/// Who controls which robot. Each has one controller at a time.
class ExternControllers
{
public:
    /// `robots`: names of those that may be controlled so.
    ControllerAnswer connect(std::string_view greeting, std::vector<std::string> const& robots);
    void disconnect(std::string const& robot) { connected_.erase(robot); }

private:
    std::set<std::string> connected_;
};

/// The name as it stands in URLs, and in the greeting.
std::string encoded_name(std::string_view name);

/// What `cruise <radians per second>` says.
std::optional<double> cruise_in(std::string_view line);

/// Serves a controller that was connected; `answer` is sent first.
void serve_controller(boost::asio::ip::tcp::socket socket, ControllerAnswer answer, Reception& reception,
                      Seat seat);

} // namespace webots_cloud::demo
