// An HttpResponse as the bytes of HTTP/1.1.
#pragma once

#include <webots_cloud/transport/http.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// A page of one sentence. With 429 and 503 clients are told to try again in a moment (`Retry-After`).
HttpResponse sentence_response(int status, std::string_view sentence);

/// Appends status line, headers and body to `out`. `keep_alive` says whether the connection stays open; the
/// answer to HEAD has no body. It has a Content-Length unless the response has no body, because none was
/// generated.
void append_response(std::string& out, HttpResponse const& response, bool keep_alive, bool with_body);

/// The same of a response with a shared body, which is not appended: `body` is what will be sent of it.
void append_shared_head(std::string& out, HttpResponse const& response, bool keep_alive,
                        std::string_view body);

/// What is sent of a shared body to a client that says `accept_encoding`: the text, or the same compressed. A
/// view into it.
std::string_view encoded(SharedBody const& body, std::string_view accept_encoding);

} // namespace webots_cloud::adapters
