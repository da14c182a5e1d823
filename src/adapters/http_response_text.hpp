// An HttpResponse as the bytes of HTTP/1.1.
#pragma once

#include <webots_cloud/transport/http.hpp>

#include <string>

namespace webots_cloud::adapters {

/// Appends status line, headers and body to `out`. `keep_alive` says whether the connection stays open; the
/// answer to HEAD is without its body.
void append_response(std::string& out, HttpResponse const& response, bool keep_alive, bool with_body);

} // namespace webots_cloud::adapters
