// Writes answers. Lines that all of them share are made once a second, and shared pages are compressed once
// for all who ask, because this runs for every request.
#include "http_response_text.hpp"

#include <ostream> // what follows forgets it

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <boost/beast/http/status.hpp>

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <ctime>
#include <optional>

namespace webots_cloud::adapters {
namespace {

/// The lines that all answers have, made anew once a second.
std::string_view common_lines()
{
    thread_local std::time_t made = 0;
    thread_local std::string text;
    auto const now = std::time(nullptr); // to the second, for a fifth of what a clock with fractions costs
    if (now != made) {
        made = now;
        text = core::concat("Server: webots_cloud\r\nDate: ",
                            core::http_date(std::chrono::system_clock::from_time_t(now)), "\r\n");
    }
    return text;
}

void append_status_line(std::string& out, int status)
{
    if (status == 200) { // nearly always, and a tenth of what the text of GET /session costs
        out.append("HTTP/1.1 200 OK\r\n");
        return;
    }
    auto const reason =
        boost::beast::http::obsolete_reason(boost::beast::http::int_to_status(static_cast<unsigned>(status)));
    out.append("HTTP/1.1 ").append(std::to_string(status)).append(" ");
    out.append(reason.data(), reason.size()).append("\r\n");
}

void append_content_length(std::string& out, std::size_t size)
{
    constexpr std::string_view name = "Content-Length: ";
    constexpr std::size_t max_digits = 20;
    std::array<char, name.size() + max_digits + 2> line;
    auto* end = std::copy(name.begin(), name.end(), line.data());
    end = std::to_chars(end, end + max_digits, size).ptr;
    *end++ = '\r';
    *end++ = '\n';
    out.append(line.data(), end);
}

// Smaller ones fit into a packet or two as they are; larger ones would take more than 4 ms of the event loop.
constexpr std::size_t worth_compressing = 1024;
constexpr std::size_t max_compressed = 512 * 1024;

// A page of 150 kB takes 1.3 ms, once for all who ask; the usual level, 6, takes three times as long for a
// sixth less.
constexpr int compression_level = 1;
constexpr int gzip_window_bits = 15 + 16;

/// Compressed; empty when zlib has no memory.
std::string compress(std::string const& text)
{
    z_stream stream{};
    if (deflateInit2(&stream, compression_level, Z_DEFLATED, gzip_window_bits, 8, Z_DEFAULT_STRATEGY) != Z_OK)
        return {};
    std::string out(deflateBound(&stream, static_cast<uLong>(text.size())), '\0');
    stream.next_in =
        reinterpret_cast<Bytef*>(const_cast<char*>(text.data())); // zlib's interface knows no const
    stream.avail_in = static_cast<uInt>(text.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    bool const is_whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
    out.resize(is_whole ? stream.total_out : 0);
    deflateEnd(&stream);
    out.shrink_to_fit();
    return out;
}

/// Whether an Accept-Encoding has gzip, and not with the weight 0.
bool takes_gzip(std::string_view accept_encoding)
{
    for (auto const part : core::split(accept_encoding, ',')) {
        auto const end = std::min(part.find(';'), part.size());
        if (!equal_ignoring_case(core::trim(part.substr(0, end)), "gzip"))
            continue;
        auto const weight = core::trim(part.substr(std::min(end + 1, part.size())));
        return !weight.starts_with("q=0") || weight.find_first_of("123456789") != std::string_view::npos;
    }
    return false;
}

/// Status line and headers; `size` is that of the body, unless it is not known.
void append_head(std::string& out, HttpResponse const& response, bool keep_alive,
                 std::optional<std::size_t> size)
{
    append_status_line(out, response.status);
    out.append(common_lines());
    if (!response.content_type.empty())
        out.append("Content-Type: ").append(response.content_type).append("\r\n");
    for (auto const& [name, value] : response.headers)
        out.append(name).append(": ").append(value).append("\r\n");
    if (size && response.status != 204 && response.status != 304)
        append_content_length(out, *size);
    out.append(response.fixed_headers);
    out.append(keep_alive ? "Connection: keep-alive\r\n\r\n" : "Connection: close\r\n\r\n");
}

} // namespace

HttpResponse sentence_response(int status, std::string_view sentence)
{
    HttpResponse response(status, "text/html; charset=UTF-8", std::string(sentence));
    if (status == 429 || status == 503)
        response.headers.emplace_back("Retry-After", "5");
    return response;
}

void append_response(std::string& out, HttpResponse const& response, bool keep_alive, bool with_body)
{
    if (with_body) {
        append_head(out, response, keep_alive, response.body.size());
        out.append(response.body);
    } else {
        bool const is_known = !response.body.empty();
        append_head(out, response, keep_alive, is_known ? std::optional(response.body.size()) : std::nullopt);
    }
}

void append_shared_head(std::string& out, HttpResponse const& response, bool keep_alive,
                        std::string_view body)
{
    if (body.data() == response.shared->text.data())
        return append_head(out, response, keep_alive, body.size());
    auto compressed = response;
    compressed.headers.emplace_back("Content-Encoding", "gzip");
    append_head(out, compressed, keep_alive, body.size());
}

std::string_view encoded(SharedBody const& body, std::string_view accept_encoding)
{
    if (!takes_gzip(accept_encoding))
        return body.text;
    bool const worth_it = body.text.size() >= worth_compressing && body.text.size() <= max_compressed;
    if (body.gzip.empty() && worth_it)
        body.gzip = compress(body.text);
    return body.gzip.empty() ? body.text : body.gzip;
}

} // namespace webots_cloud::adapters
