#include "controllers.hpp"

#include "async/wakeup.hpp"
#include "core/text.hpp"

namespace webots_cloud::app {

namespace asio = boost::asio;

Controllers::Controllers(asio::any_io_executor executor, std::uint16_t port, NetworkConfig const& network,
                         ControllerDoor& door, Logger log)
    : log_(std::move(log))
{
    if (port == 0)
        return;
    ControllerServerParams params;
    params.address = network.listen_address;
    params.port = port;
    server_ = make_controller_server(std::move(executor), std::move(params), door, log_);
}

result<> Controllers::listen()
{
    if (!server_)
        return {};
    auto const listening = server_->listen();
    if (listening)
        log_.info(core::concat("Controllers on other machines connect, without encryption, to port ",
                               std::to_string(server_->port())));
    return listening;
}

asio::awaitable<result<>> Controllers::run()
{
    if (server_)
        co_return co_await server_->run();
    co_return co_await async::until_cancelled();
}

std::size_t descriptors_of_controllers(std::uint16_t port)
{
    return port == 0 ? 0 : 2 * ControllerServerParams().max_connections;
}

result<> listen(HttpServer& server, HttpsRedirect& redirect, Controllers& controllers)
{
    if (auto const listening = server.listen(); !listening)
        return listening;
    if (auto const listening = redirect.listen(); !listening)
        return listening;
    return controllers.listen();
}

} // namespace webots_cloud::app
