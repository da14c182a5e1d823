#pragma once

#include "connection.hpp"

#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>

namespace webots_cloud::demo {

/// Serves a peer that asked for an upgrade to WebSocket.
void serve_websocket(boost::beast::tcp_stream stream,
                     boost::beast::http::request<boost::beast::http::empty_body> upgrade,
                     Reception& reception, Seat seat);

} // namespace webots_cloud::demo
