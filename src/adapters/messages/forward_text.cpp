// Writes the heads of forwarded requests and answers anew from what was understood, never by copying: so both
// sides agree on where a message ends. Which fields pass is in core/access/passed_headers.hpp.
#include "forward_text.hpp"

#include "core/access/passed_headers.hpp"
#include "head_parser.hpp"

#include <algorithm>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;

namespace {

constexpr int first_final_status = 200;
constexpr std::string_view handshake = "Sec-WebSocket-";

void append_field(std::string& out, std::string_view name, std::string_view value)
{
    out.append(name).append(": ").append(value).append("\r\n");
}

/// Whom the request has come from so far: what proxies said, then the peer.
std::string forwarded_for(IncomingRequest const& request)
{
    std::string list;
    for (auto const& [name, value] : request.headers)
        if (equal_ignoring_case(name, "X-Forwarded-For") && !value.empty())
            list.append(value).append(", ");
    if (list.empty() && request.client != request.peer) // a proxy that has said so with "Forwarded"
        list.append(request.client).append(", ");
    return list.append(request.peer);
}

} // namespace

std::string forwarded_request(HttpRequestReader const& reader, IncomingRequest const& request,
                              Forward const& forward, bool keep_alive)
{
    std::string out;
    out.append(request.method).append(" ").append(forward.target);
    out.append(reader.is_http_1_0() ? " HTTP/1.0\r\n" : " HTTP/1.1\r\n");
    auto const is_replaced = [&forward](std::string_view name) {
        return std::any_of(forward.headers.begin(), forward.headers.end(),
                           [name](auto const& header) { return equal_ignoring_case(header.first, name); });
    };
    // A handshake that ends here is not the other server's.
    auto const is_passed = [&forward](std::string_view name) {
        return core::is_request_header_passed(name, forward.kind) &&
               !(forward.in_messages && equal_ignoring_case(name.substr(0, handshake.size()), handshake));
    };
    bool has_length = false;
    for (auto const& [name, value] : request.headers) {
        has_length = has_length || equal_ignoring_case(name, "Content-Length");
        if (is_passed(name) && !is_replaced(name))
            append_field(out, name, value);
    }
    for (auto const& [name, value] : forward.headers)
        if (!value.empty())
            append_field(out, name, value);
    if (has_length)
        append_field(out, "Content-Length", "0"); // the reader takes no other
    if (core::is_told_clients(forward.kind))
        append_field(out, "X-Forwarded-For", forwarded_for(request));
    out.append(request.upgrade && !forward.in_messages ? "Upgrade: websocket\r\nConnection: Upgrade\r\n\r\n"
               : keep_alive                            ? "Connection: keep-alive\r\n\r\n"
                                                       : "Connection: close\r\n\r\n");
    return out;
}

/// What Beast finds, for one answer.
class ForwardedResponse::Parser final : public HeadParser<false>
{
public:
    explicit Parser(ForwardedResponse& response) : response_(response)
    {
        header_limit(max_response_head);
        body_limit(boost::none);
        skip(true);
    }

    bool read(std::string_view head)
    {
        boost::system::error_code error;
        put(asio::buffer(head), error);
        return !error && is_header_done();
    }

private:
    void on_response_impl(int status, beast::string_view reason, int, boost::system::error_code&) override
    {
        response_.status_ = status;
        response_.reason_ = reason;
    }

    void on_field_impl(http::field field, beast::string_view name, beast::string_view value,
                       boost::system::error_code&) override
    {
        response_.is_coded_ = response_.is_coded_ || field == http::field::transfer_encoding;
        if (core::is_answer_header_passed(name, response_.kind_))
            response_.fields_.emplace_back(name, value);
    }

    ForwardedResponse& response_;
};

ForwardedResponse::Progress ForwardedResponse::parse(std::string_view received)
{
    constexpr std::string_view end_of_head = "\r\n\r\n";
    for (;;) {
        auto const rest = received.substr(head_size_);
        auto const end = rest.find(end_of_head);
        auto const size = end == std::string_view::npos ? rest.size() : end + end_of_head.size();
        if (head_size_ + size > max_response_head)
            return Progress::malformed;
        if (end == std::string_view::npos)
            return Progress::need_more;
        fields_.clear();
        is_coded_ = false;
        Parser parser(*this);
        if (!parser.read(rest.substr(0, size)))
            return Progress::malformed;
        head_size_ += size;
        bool const accepts = status_ == 101;
        if (accepts && !is_upgrade_)
            return Progress::malformed;
        if (status_ == 401 && !core::is_answer_header_passed("WWW-Authenticate", kind_)) {
            // A browser would forget the password that it knows for this site: it is not this server's to
            // refuse.
            status_ = 403;
            reason_ = "Forbidden";
        }
        if (status_ >= first_final_status || accepts) {
            keeps_connection_ = parser.keep_alive();
            auto const length = parser.content_length();
            find_body(parser.chunked(),
                      length ? std::optional<std::uint64_t>(*length) : std::optional<std::uint64_t>());
            if (is_coded_ && !parser.chunked())
                return Progress::malformed; // another coding than chunks: nobody who has asked for none can
                                            // read it
            return Progress::complete;
        }
        // An interim answer (RFC 9110, 15.2) to something that the browser did not ask for.
    }
}

bool ForwardedResponse::has(std::string_view name) const
{
    return std::any_of(fields_.begin(), fields_.end(),
                       [name](auto const& field) { return equal_ignoring_case(field.first, name); });
}

void ForwardedResponse::add_missing(std::string_view name, std::string_view value)
{
    if (!has(name))
        fields_.emplace_back(name, value);
}

void ForwardedResponse::add(std::string_view name, std::string_view value)
{
    added_.emplace_back(name, value);
}

void ForwardedResponse::find_body(bool is_chunked, std::optional<std::uint64_t> length)
{
    length_ = length;
    if (status_ == 101)
        body_ = Body::websocket;
    else if (is_head_ || status_ == 204 || status_ == 304)
        body_ = Body::none;
    else if (is_chunked)
        body_ = Body::chunked;
    else
        body_ = length ? Body::counted : Body::endless;
}

void ForwardedResponse::append_head(std::string& out, bool keep_alive) const
{
    out.append("HTTP/1.1 ").append(std::to_string(status_)).append(" ").append(reason_).append("\r\n");
    for (auto const& [name, value] : fields_)
        append_field(out, name, value);
    if (body_ == Body::websocket) {
        out.append("Upgrade: websocket\r\nConnection: Upgrade\r\n\r\n");
        return;
    }
    // How long the body is, is said in our own words: what the other server says can be neither left out nor
    // doubted by its other fields.
    if (body_ == Body::chunked)
        append_field(out, "Transfer-Encoding", "chunked");
    else if (length_ && status_ != 204)
        append_field(out, "Content-Length", std::to_string(*length_));
    for (auto const& [name, value] : added_)
        append_field(out, name, value);
    out.append(keep_alive ? "Connection: keep-alive\r\n\r\n" : "Connection: close\r\n\r\n");
}

} // namespace webots_cloud::adapters
