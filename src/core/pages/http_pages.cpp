#include "http_pages.hpp"

#include "core/text.hpp"
#include "metrics_text.hpp"

#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

namespace webots_cloud::core {
namespace {

HttpResponse status_page(int status, std::string_view text)
{
    return {status, std::string(html_type),
            concat("<html><title>", text, "</title><body>", text, "</body></html>")};
}

} // namespace

HttpResponse page(std::string body)
{
    return {200, std::string(html_type), std::move(body)};
}

HttpResponse json_page(std::string body)
{
    return {200, "application/json", std::move(body)};
}

HttpResponse metrics_page(std::string own, std::function<std::string()> const& more)
{
    if (more)
        own += more();
    return {200, std::string(metrics_type), std::move(own)};
}

HttpResponse readiness_page(std::string_view but, bool as_json)
{
    if (as_json)
        return json_page(boost::json::serialize(boost::json::object{{"ready", true}, {"but", but}}));
    return page(but.empty() ? "ready" : concat("ready, but: ", escape_html(but)));
}

HttpResponse not_found_page()
{
    return status_page(404, "404: Not Found");
}

HttpResponse two_slashes_page()
{
    return {
        404, std::string(html_type),
        "Nothing here begins with two slashes. Where the proxy in front has added one, its address of this "
        "server ends with a slash too many."};
}

HttpResponse options_page()
{
    HttpResponse response(204, {}, {});
    response.headers.emplace_back("Allow", "GET, HEAD, OPTIONS, POST");
    return response;
}

HttpResponse method_not_allowed_page(std::string_view allow)
{
    auto response = status_page(405, "405: Method Not Allowed");
    response.headers.emplace_back("Allow", allow);
    return response;
}

} // namespace webots_cloud::core
