// The port for controllers of robots that run on other machines.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/controllers.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Where controllers connect, and what they are granted.
struct ControllerServerParams
{
    ControllerServerParams() = default;

    std::string address = "::"; ///< Numeric; `::` is every address, of IPv4 too.
    std::uint16_t port = 0;     ///< 0: any free one, see `ControllerServer::port`.
    std::size_t max_connections = 256;
    std::size_t per_simulation = 16;
    // Connections that have not been passed on yet; with one more, the oldest is closed.
    std::size_t max_greeting = 64;
    std::size_t greeting_per_address = 16;
    Duration greeting_timeout = std::chrono::seconds(10); ///< For the whole greeting.
    /// Nothing marks the end of a greeting: it has come when for so long no more has.
    Duration greeting_pause = std::chrono::milliseconds(100);
    Duration connect_timeout = std::chrono::seconds(5); ///< To reach the simulator.
    Duration answer_timeout = std::chrono::seconds(30); ///< For it to answer.
    Duration write_timeout = std::chrono::seconds(30);  ///< For either side to take what the other one says.
    Duration idle_timeout = std::chrono::hours(1);      ///< For either side to say something.
};

/// Passes connections of controllers on to simulators. Of what they say it reads the greeting and the
/// simulator's answer to that, nothing else.
///
/// Lifetime: must outlive its operations: await their end before it is destroyed.
class ControllerServer
{
public:
    virtual ~ControllerServer() = default;

    /// Opens the port.
    ///
    /// Errors: as `HttpServer::listen`, but for `invalid_config`.
    virtual result<> listen() = 0;

    /// Serves until cancelled, then ends all connections.
    ///
    /// Precondition: `listen` succeeded.
    /// Errors: `operation_aborted`.
    virtual boost::asio::awaitable<result<>> run() = 0;

    /// The port that is listened on.
    /// Precondition: `listen` succeeded.
    virtual std::uint16_t port() const = 0;
};

/// Lifetime: `door` must outlive it.
std::unique_ptr<ControllerServer> make_controller_server(boost::asio::any_io_executor executor,
                                                         ControllerServerParams params, ControllerDoor& door,
                                                         Logger log);

} // namespace webots_cloud
