// How a session server asks a machine something.
#pragma once

#include "core/access/forwarding.hpp"

#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/transport/http_client.hpp>

#include <string_view>
#include <utility>

namespace webots_cloud {

/// `GET path` of a machine, inside where the configuration says how.
inline HttpRequest machine_request(ServerSpec const& server, LoadMonitorParams const& polls,
                                   std::string_view path)
{
    HttpRequest request;
    if (server.internal_address.empty()) {
        request.url = server_url(server.address, polls.tls, path);
    } else {
        auto inside = core::internal_request(server.internal_address, server.internal_name, path);
        request.url = std::move(inside.url);
        request.address = std::move(inside.address);
    }
    request.timeout = polls.timeout;
    request.elsewhere = server.elsewhere;
    return request;
}

} // namespace webots_cloud
