// The opening handshake of a WebSocket (RFC 6455, 4.2). No sockets.
#pragma once

#include "http_request_reader.hpp"

#include <webots_cloud/transport/http.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// True when the client tries to open a WebSocket, correctly or not: GET, HTTP/1.1 and "Upgrade: websocket".
bool wants_websocket(HttpRequestReader const& reader) noexcept;

/// What is wrong with a handshake: 400 with an explanation, or 426 with the version that we support; nothing
/// when it is valid.
///
/// Precondition: `wants_websocket`.
std::optional<HttpResponse> refuse_handshake(HttpRequestReader const& reader);

/// Appends the answer 101 to the client's `key`.
void append_handshake_answer(std::string& out, std::string_view key);

} // namespace webots_cloud::adapters
