// The port for controllers on other machines, of both servers, if there is one.
#pragma once

#include "https_redirect.hpp"

#include <webots_cloud/adapters/controller_server.hpp>
#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/config.hpp>

namespace webots_cloud::app {

class Controllers
{
public:
    /// `port`: 0: none.   Lifetime: `door` must outlive it.
    Controllers(boost::asio::any_io_executor executor, std::uint16_t port, NetworkConfig const& network,
                ControllerDoor& door, Logger log);

    /// Errors: as `ControllerServer::listen`.
    result<> listen();

    /// Serves until cancelled.   Precondition: `listen` succeeded.
    boost::asio::awaitable<result<>> run();

private:
    Logger log_;
    std::unique_ptr<ControllerServer> server_; ///< Null: there is no such port.
};

/// How many descriptors it takes at most.
std::size_t descriptors_of_controllers(std::uint16_t port);

/// All ports of a server.   Errors: of the first that can't be listened on.
result<> listen(HttpServer& server, HttpsRedirect& redirect, Controllers& controllers);

} // namespace webots_cloud::app
