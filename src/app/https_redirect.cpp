#include "https_redirect.hpp"

#include "async/wakeup.hpp"
#include "challenges.hpp"
#include "core/access/asked_name.hpp"
#include "core/access/https_address.hpp"
#include "core/text.hpp"
#include "operator_requests.hpp"

#include <webots_cloud/adapters/http_server.hpp>

#include <optional>

namespace webots_cloud::app {

namespace asio = boost::asio;
using core::concat;

namespace {

constexpr std::string_view html = "text/html; charset=UTF-8";

core::SiteAccess site_of(PublicAddress const& address, AccessConfig const& access)
{
    auto names = machine_names();
    names.insert(names.end(), access.host_names.begin(), access.host_names.end());
    names.push_back(address.host);
    return {core::Reach::everybody, names, nullptr};
}

std::unique_ptr<HttpServer> plain_server(asio::any_io_executor const& executor, NetworkConfig network,
                                         Logger const& log)
{
    auto const port = network.redirect_port;
    network.ssl_certificate.clear();
    network.ssl_key.clear();
    HttpServerParams params(std::move(network), port);
    params.max_connections = max_redirected;
    params.spare_descriptors += max_redirected;
    return make_http_server(executor, std::move(params), log);
}

} // namespace

struct HttpsRedirect::Impl final : Endpoint
{
    Impl(asio::any_io_executor const& executor, PublicAddress public_address, NetworkConfig const& network,
         AccessConfig const& access, Logger logger)
        : address(std::move(public_address)), site(site_of(address, access)),
          challenges(network.challenge_folder, *this), log(std::move(logger))
    {
        if (network.redirect_port != 0)
            server = plain_server(executor, network, log);
    }

    Answer respond(IncomingRequest const& request) override
    {
        auto const target =
            request.query.empty() ? std::string(request.path) : concat(request.path, "?", request.query);
        bool const keeps_method = request.method == "GET" || request.method == "HEAD"; // with any status
        HttpResponse response(keeps_method ? 301 : 308, std::string(html), "This site speaks https.");
        auto const host = request.header("Host");
        auto const name = core::reached_at(address, core::asked_address(request.headers, false)).host;
        response.headers.emplace_back("Location",
                                      core::https_address(host, site, name, address.port, target));
        return response;
    }

    asio::awaitable<void> serve_websocket(ChannelInfo, Channel&) override { co_return; }

    PublicAddress const address;
    core::SiteAccess const site;
    Challenges challenges;
    Logger log;
    std::unique_ptr<HttpServer> server; ///< Null: there is no such port.
};

std::size_t descriptors_of_redirect(NetworkConfig const& network)
{
    return network.redirect_port == 0 ? 0 : max_redirected;
}

HttpsRedirect::HttpsRedirect(asio::any_io_executor executor, PublicAddress const& address,
                             NetworkConfig const& network, AccessConfig const& access, Logger log)
    : impl_(std::make_unique<Impl>(executor, address, network, access, std::move(log)))
{}

HttpsRedirect::~HttpsRedirect() = default;

result<> HttpsRedirect::listen()
{
    return impl_->server ? impl_->server->listen() : result<>();
}

asio::awaitable<result<>> HttpsRedirect::run()
{
    if (impl_->server)
        co_return co_await impl_->server->run(impl_->challenges);
    co_return co_await async::until_cancelled();
}

} // namespace webots_cloud::app
