// The answers that both servers give alike, to the byte what browsers have always got.
#pragma once

#include <webots_cloud/transport/http.hpp>

#include <functional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The content type of every text that the servers answer, plain text included.
inline constexpr std::string_view html_type = "text/html; charset=UTF-8";

/// 200 with a body.
HttpResponse page(std::string body);

HttpResponse json_page(std::string body);

/// Of a server that is ready: `ready`, or `ready, but: <sentences>`, or the same as JSON.
HttpResponse readiness_page(std::string_view but, bool as_json);

HttpResponse not_found_page();

/// 404 for a path that begins with two slashes: people learn whose fault that is. It is no other spelling of
/// a path, since rules of proxies about paths would not hold for it.
HttpResponse two_slashes_page();

/// The answer to `GET /metrics`: `own` figures, and below them those of `more`, unless that is empty.
HttpResponse metrics_page(std::string own, std::function<std::string()> const& more);

/// 204, with the methods that some path of a server has.
HttpResponse options_page();

/// 405, `allow` being the value of the Allow header.
HttpResponse method_not_allowed_page(std::string_view allow);

} // namespace webots_cloud::core
