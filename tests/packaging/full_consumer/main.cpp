// An outside program over the real transports: it serves a page of its own and asks itself for it.
#include <webots_cloud/adapters.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>

#include <filesystem>
#include <iostream>

namespace {

using namespace webots_cloud;
namespace asio = boost::asio;

class Greeter final : public Endpoint
{
public:
    Answer respond(IncomingRequest const&) override { return HttpResponse(200, "text/plain", "hello"); }

    asio::awaitable<void> serve_websocket(ChannelInfo, Channel&) override { co_return; }
};

asio::awaitable<result<>> ask(HttpClient& http, std::uint16_t port)
{
    HttpRequest request("http://127.0.0.1:" + std::to_string(port) + "/greeting");
    auto const response = co_await http.send(std::move(request));
    if (!response)
        co_return response.error();
    std::cout << "answered " << response->body << std::endl;
    co_return result<>();
}

asio::awaitable<result<>> serve_and_ask(HttpServer& server, Endpoint& endpoint, HttpClient& http)
{
    using namespace asio::experimental::awaitable_operators;
    auto const ended = co_await (server.run(endpoint) || ask(http, server.port()));
    co_return std::visit([](result<> const& outcome) { return outcome; }, ended);
}

} // namespace

int main()
{
    asio::io_context context(1);
    Greeter greeter;
    HttpServerParams params;
    params.network.listen_address = "127.0.0.1";
    auto const http = make_http_client(context.get_executor());
    auto const server = make_http_server(context.get_executor(), params, {});
    GitFolders folders(std::filesystem::temp_directory_path() / "webots_cloud_full_consumer");
    auto const git =
        make_git_source(context.get_executor(), {}, {}, folders, {}); // linked, though not asked for anything
    if (!server->listen())
        return 1;

    int status = 1;
    asio::co_spawn(context, serve_and_ask(*server, greeter, *http),
                   [&](std::exception_ptr failure, result<> outcome) {
                       if (failure)
                           std::rethrow_exception(failure);
                       status = outcome ? 0 : 1;
                   });
    context.run();
    return status;
}
