// What a server itself says to simulators, as a seam.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Speaks with simulators as their browsers do.
class SimulatorTalk
{
public:
    virtual ~SimulatorTalk() = default;

    /// Says these texts on a connection of its own, and hears what it is told until the answer `last` has
    /// come and the simulator has closed the connection. It takes two seconds at most.
    ///
    /// Returns: what it has heard; without `last` where the simulator could not be reached, or has not
    /// answered in time.
    /// Cancellation: none.
    virtual boost::asio::awaitable<std::vector<std::string>>
    talk(Upstream simulator, std::vector<std::string> words, std::string last) = 0;
};

} // namespace webots_cloud
