#include "http_response_text.hpp"

#include <ostream> // what follows forgets it

#include <boost/beast/http/status.hpp>

#include <charconv>
#include <ctime>

namespace webots_cloud::adapters {
namespace {

/// The value of a Date header, made anew once a second.
std::string_view http_date()
{
    thread_local std::time_t made = 0;
    thread_local char text[40];
    thread_local std::size_t length = 0;
    auto const now = std::time(nullptr); // to the second, for a fifth of what a clock with fractions costs
    if (now != made) {
        made = now;
        std::tm parts{};
        gmtime_r(&now, &parts);
        length = std::strftime(text, sizeof text, "%a, %d %b %Y %H:%M:%S GMT", &parts);
    }
    return {text, length};
}

void append_number(std::string& out, std::size_t number)
{
    char digits[24];
    out.append(digits, std::to_chars(digits, digits + sizeof digits, number).ptr);
}

} // namespace

void append_response(std::string& out, HttpResponse const& response, bool keep_alive, bool with_body)
{
    auto const reason = boost::beast::http::obsolete_reason(
        boost::beast::http::int_to_status(static_cast<unsigned>(response.status)));
    out.append("HTTP/1.1 ");
    append_number(out, static_cast<std::size_t>(response.status));
    out.append(" ").append(reason.data(), reason.size());
    out.append("\r\nServer: webots_cloud\r\nDate: ").append(http_date());
    if (!response.content_type.empty())
        out.append("\r\nContent-Type: ").append(response.content_type);
    for (auto const& [name, value] : response.headers)
        out.append("\r\n").append(name).append(": ").append(value);
    if (response.status != 204) {
        out.append("\r\nContent-Length: ");
        append_number(out, response.body.size());
    }
    out.append("\r\n").append(response.fixed_headers);
    out.append(keep_alive ? "Connection: keep-alive\r\n\r\n" : "Connection: close\r\n\r\n");
    if (with_body)
        out.append(response.body);
}

} // namespace webots_cloud::adapters
