// How a session server asks a machine something.
#pragma once

#include "core/access/forwarding.hpp"
#include "core/text.hpp"

#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

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

/// `path` of a machine as a WebSocket, likewise.
inline WebSocketRequest machine_websocket(ServerSpec const& server, bool tls, std::string_view path)
{
    WebSocketRequest request(core::concat(tls ? "wss://" : "ws://", server.address, path));
    if (!server.internal_address.empty()) {
        auto inside = core::internal_request(server.internal_address, server.internal_name, path);
        request.url = core::concat("ws", inside.url.substr(4)); // in place of "http"
        request.address = std::move(inside.address);
    }
    request.elsewhere = server.elsewhere;
    return request;
}

/// `host/2000` is reached at `host`, `host:2000` there.
inline std::string_view authority_of_entry(std::string_view entry) noexcept
{
    return entry.substr(0, entry.find('/'));
}

} // namespace webots_cloud
