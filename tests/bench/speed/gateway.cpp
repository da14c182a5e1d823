// Our gateway and nothing else: every request is passed on to one other server.
//
//     speed_gateway PORT UPSTREAM_PORT [CERTIFICATE KEY [AUTHORITIES]]
//
// With AUTHORITIES the other server is reached by TLS.
#include <webots_cloud/adapters.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/io_context.hpp>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <sys/resource.h>

namespace {

using namespace webots_cloud;

class Gateway final : public Endpoint
{
public:
    Gateway(std::uint16_t port, bool tls) : upstream_("127.0.0.1", port) { upstream_.tls = tls; }

    Answer respond(IncomingRequest const& request) override
    {
        Forward forward;
        forward.upstream = upstream_;
        forward.target = request.path;
        if (!request.query.empty())
            forward.target.append("?").append(request.query);
        forward.group = group_;
        return forward;
    }

    boost::asio::awaitable<void> serve_websocket(ChannelInfo, Channel&) override { co_return; }

private:
    Upstream upstream_;
    std::shared_ptr<TunnelGroup> group_ = std::make_shared<TunnelGroup>();
};

boost::asio::awaitable<void> serve(HttpServer& server, Endpoint& endpoint)
{
    auto const ended = co_await server.run(endpoint);
    std::fprintf(stderr, "%s\n", ended.error().message().c_str());
    std::exit(1);
}

} // namespace

int main(int argc, char** argv)
{
    if (argc != 3 && argc != 5 && argc != 6)
        return 2;
    rlimit limit{};
    ::getrlimit(RLIMIT_NOFILE, &limit);
    limit.rlim_cur = limit.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &limit);
    std::signal(SIGPIPE, SIG_IGN);
    boost::asio::io_context context(1);
    HttpServerParams params;
    params.network.listen_address = "127.0.0.1";
    params.port = static_cast<std::uint16_t>(std::atoi(argv[1]));
    if (argc >= 5) {
        params.network.ssl_certificate = argv[3];
        params.network.ssl_key = argv[4];
    }
    if (argc == 6)
        params.tls_authorities = argv[5];
    auto const server = make_http_server(context.get_executor(), params, Logger());
    Gateway gateway(static_cast<std::uint16_t>(std::atoi(argv[2])), argc == 6);
    boost::asio::co_spawn(context, serve(*server, gateway), boost::asio::detached);
    context.run();
}
