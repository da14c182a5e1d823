// What a server answers at which path, as a table: by which methods, to whom, and which function answers.
#pragma once

#include "core/pages/http_methods.hpp"
#include "core/pages/http_pages.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <algorithm>
#include <span>
#include <string_view>

namespace webots_cloud {

/// What becomes of a WebSocket handshake.
enum class Upgrade : bool
{
    ignored, ///< It is answered like any other request.
    accepted
};

/// One row. What AccessControl asks of requests (`Host`, `Origin`, the monitor's password) comes first.
template<class Service>
struct Route
{
    std::string_view path; ///< With `*` at its end: every path that begins so.
    core::Methods methods; ///< Others are answered 405.
    bool (Service::*may_ask)(IncomingRequest const&) const; ///< Nobody else finds the path: 404.
    Upgrade upgrade;
    Answer (Service::*respond)(IncomingRequest const&);
    std::string_view refusal_headers = {}; ///< `fixed_headers` of the answer 405.
};

/// For `Route::may_ask`.
inline constexpr auto everybody = nullptr;

namespace route_table {

constexpr bool matches(std::string_view pattern, std::string_view path) noexcept
{
    return pattern.ends_with('*') ? path.starts_with(pattern.substr(0, pattern.size() - 1)) : path == pattern;
}

/// The first row for a path; none: null.
template<class Service>
constexpr Route<Service> const* find(std::span<Route<Service> const> routes, std::string_view path) noexcept
{
    auto const found = std::find_if(routes.begin(), routes.end(), [path](Route<Service> const& route) {
        return matches(route.path, path);
    });
    return found == routes.end() ? nullptr : &*found;
}

/// A request for what the server can do at all, as health checks of proxies send it: HAProxy's does, unless
/// it is told otherwise. It needs no row.
inline bool asks_for_options(IncomingRequest const& request) noexcept
{
    return request.method == "OPTIONS" && (request.path == "/" || request.path == "*");
}

template<class Service>
Answer respond(std::span<Route<Service> const> routes, Service& service, IncomingRequest const& request)
{
    if (asks_for_options(request))
        return core::options_page();
    auto const* const route = find(routes, request.path);
    if (request.path.starts_with("//"))
        return core::two_slashes_page();
    if (!route || (route->may_ask && !(service.*route->may_ask)(request)))
        return core::not_found_page();
    if (!core::permits(route->methods, request.method)) {
        auto refusal = core::method_not_allowed_page(core::allow_header(route->methods));
        refusal.fixed_headers = route->refusal_headers;
        return refusal;
    }
    if (request.upgrade && route->upgrade == Upgrade::accepted)
        return AcceptWebSocket();
    return (service.*route->respond)(request);
}

} // namespace route_table

} // namespace webots_cloud
