// Requests of one connection, one after the other: read, name the client (trusted proxies may say who it is),
// count it, ask the Endpoint, give its answer. Each wait has a deadline. A WebSocket leaves by `Outcome` and
// goes on in websocket_channel.cpp; what an Endpoint forwards goes on in tunnel.cpp.
#include "http_connection.hpp"

#include "adapters/messages/http_response_text.hpp"
#include "adapters/messages/websocket_handshake.hpp"
#include "core/access/asked_name.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/simulation/public_base.hpp"
#include "core/text.hpp"

#include <boost/asio/awaitable.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/post.hpp>

#include <algorithm>
#include <array>
#include <ctime>
#include <variant>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

constexpr std::size_t flush_size = 64 * 1024; // answers to pipelined requests are sent together up to here
constexpr std::size_t body_piece = 16 * 1024;
constexpr int max_drained = 64; // reads, after a refusal

constexpr std::string_view speaks_https =
    "This port speaks HTTPS: put https:// (or wss://) in front of the address.\r\n";

constexpr std::string_view too_many_connections = "Too many connections. Please try again in a moment.\r\n";

constexpr std::string_view no_memory = "The server is busy. Please try again in a moment.\r\n";

std::uint64_t& refusal_counter(HttpServerStatistics& statistics, int status)
{
    switch (status) {
    case 413:
        return statistics.refused_bodies;
    case 414:
        return statistics.long_request_lines;
    case 431:
        return statistics.long_headers;
    default:
        return statistics.bad_requests;
    }
}

} // namespace

HttpConnection::HttpConnection(NetworkStream stream, Peer peer, ConnectionLimit::Ticket ticket,
                               HttpConnectionContext const& context)
    : stream_(std::move(stream)), ticket_(std::move(ticket)), context_(context), peer_(std::move(peer))
{}

asio::awaitable<bool> HttpConnection::await_first_request()
{
    set_deadline(context_.params.header_timeout);
    if (stream_.is_tls()) {
        auto const failed = co_await stream_.answer_handshake(context_.handshakes, peer_.client());
        if (failed) {
            ++context_.statistics.tls_failures;
            if (stream_.turn_plain())
                co_await refuse(400, "a request without TLS", speaks_https);
            co_return false;
        }
    }
    bool const complete = co_await read_request(context_.params.header_timeout);
    co_return complete;
}

asio::awaitable<HttpConnection::Outcome> HttpConnection::answer_requests()
{
    for (;;) {
        auto next = Next::close;
        if (request_body_)
            next = co_await answer_to_body();
        else
            next = answer();
        if (next == Next::forward)
            next = co_await forward();
        if (next == Next::tunnel)
            co_return Outcome::tunnel;
        // Answers to pipelined requests are gathered and sent together, up to a limit.
        bool const may_wait =
            next == Next::request && !body_ && reader_.rest().size() > 0 && out_.size() < flush_size;
        if (!may_wait) {
            bool sent = flush_at_once();
            if (!sent)
                sent = co_await flush();
            if (!sent)
                co_return Outcome::over;
            if (next == Next::close || stopping_) {
                stream_.say_end();
                co_return Outcome::over;
            }
            if (next == Next::websocket)
                co_return Outcome::websocket;
            if (reader_.rest().size() > 0) // who has sent many requests at once does not keep others waiting
                co_await asio::post(asio::deferred);
        }
        reader_.next();
        bool const complete = co_await read_request(context_.params.idle_timeout);
        if (!complete)
            co_return Outcome::over;
    }
}

void HttpConnection::set_deadline(Duration from_now)
{
    // The time of the last tick, some milliseconds ago, costs a fifth of the exact one; deadlines are seconds
    // away.
    timespec tick{};
    ::clock_gettime(CLOCK_MONOTONIC_COARSE, &tick);
    deadline_ =
        TimePoint(std::chrono::seconds(tick.tv_sec) + std::chrono::nanoseconds(tick.tv_nsec)) + from_now;
}

/// Reads until a request's head is complete; false when the connection is to be closed.
asio::awaitable<bool> HttpConnection::read_request(Duration patience)
{
    // Waiting for a request costs little, so the client may take its time. Once it has begun, one deadline
    // counts for all of it: else a client could hold on for ever, byte by byte.
    bool has_begun = reader_.has_begun();
    set_deadline(has_begun ? context_.params.header_timeout : patience);
    for (;;) {
        auto const progress = reader_.parse();
        if (progress == HttpRequestReader::Progress::complete)
            co_return true;
        if (progress == HttpRequestReader::Progress::with_body) {
            bool const taken = co_await read_body();
            co_return taken;
        }
        if (progress == HttpRequestReader::Progress::refused) {
            co_await refuse(reader_.refusal(), "a malformed or oversized request");
            co_return false;
        }
        if (!out_.empty()) { // answers to earlier requests must not wait for the rest of this one
            bool const sent = co_await flush();
            if (!sent)
                co_return false;
        }
        if (!has_begun && reader_.has_begun()) {
            has_begun = true;
            set_deadline(context_.params.header_timeout);
        }
        auto const span = reader_.prepare();
        auto const space = asio::buffer(span.data(), span.size());
        boost::system::error_code failed;
        awaiting_request_ = true;
        if (stream_.is_tls()) {
            auto const [error, size] = co_await stream_.read_some(space);
            failed = error;
            reader_.commit(size);
        } else {
            auto const [error, size] = co_await stream_.read_plain(space);
            failed = error;
            reader_.commit(size);
        }
        awaiting_request_ = false;
        if (failed || is_cut_)
            co_return false;
    }
}

/// Reads the body that follows a request's head, where the endpoint takes it; false when the connection is to
/// be closed.
asio::awaitable<bool> HttpConnection::read_body()
{
    auto request = reader_.request();
    name_client(request);
    auto const length = reader_.body_length();
    if (length > context_.endpoint->max_body(request)) {
        co_await refuse(413, "a body that is too long, or not expected");
        co_return false;
    }
    auto body = std::make_unique<RequestBody>(context_.bodies, quota_key());
    // What came with the head is the beginning of the body; whatever follows that is the next request.
    auto const begun = reader_.rest().substr(
        0, static_cast<std::size_t>(std::min<std::uint64_t>(length, reader_.rest().size())));
    if (!body->has_room(begun.size())) {
        // Before we wait for the client to take our answer: others want that memory.
        body.reset();
        co_await refuse(503, "a body, for which there is no memory", no_memory);
        co_return false;
    }
    body->append(begun);
    reader_.skip(begun.size());
    // RFC 9110, 10.1.1: a client that has begun to send does not wait for permission.
    bool const wants_word = equal_ignoring_case(request.header("Expect"), "100-continue");
    if (wants_word && begun.empty() && !reader_.is_http_1_0())
        out_ += "HTTP/1.1 100 Continue\r\n\r\n";
    if (!out_.empty() && begun.size() < length) { // answers to earlier requests do not wait for the body
        bool const sent = co_await flush();
        if (!sent)
            co_return false;
    }
    set_deadline(context_.params.body_timeout);
    std::array<char, body_piece> piece; // NOLINT(cppcoreguidelines-pro-type-member-init): it is read into
    while (body->text().size() < length) {
        if (!body->has_room(piece.size())) {
            body.reset();
            co_await refuse(503, "a body, for which there is no memory", no_memory);
            co_return false;
        }
        auto const wanted =
            static_cast<std::size_t>(std::min<std::uint64_t>(piece.size(), length - body->text().size()));
        auto const space = asio::buffer(piece.data(), wanted);
        awaiting_request_ = true;
        auto const [failed, size] = co_await stream_.read_some(space);
        awaiting_request_ = false;
        if (failed || is_cut_)
            co_return false;
        body->append(std::string_view(piece.data(), size));
    }
    request_body_ = std::move(body);
    co_return true;
}

/// As `answer`, for a request with a body.
asio::awaitable<HttpConnection::Next> HttpConnection::answer_to_body()
{
    ++context_.statistics.requests;
    if (!out_.empty()) { // answers to earlier requests do not wait for this one
        bool const sent = co_await flush();
        if (!sent)
            co_return Next::close;
    }
    auto request = reader_.request();
    name_client(request);
    request.body = request_body_->text();
    deadline_ = TimePoint::max(); // it is not the client that is late
    auto const response = co_await context_.endpoint->respond_to_body(request);
    request_body_.reset();
    if (is_cut_)
        co_return Next::close;
    co_return give(response, request);
}

/// Appends the answer to what is to be sent.
HttpConnection::Next HttpConnection::answer()
{
    ++context_.statistics.requests;
    auto request = reader_.request();
    name_client(request);
    // A handshake that can't become a WebSocket is refused before the endpoint has any work with it.
    if (wants_websocket(reader_)) {
        if (auto const refusal = refuse_handshake(reader_)) {
            ++context_.statistics.bad_handshakes;
            return give(*refusal, request);
        }
        request.upgrade = true;
    }
    auto answer = context_.endpoint->respond(request);
    if (auto const* response = std::get_if<HttpResponse>(&answer))
        return give(*response, request);
    // Only what lasts takes one of the client's places: the answers above do not.
    if (request.upgrade && !admit_client())
        return refuse_connection(429, request);
    if (auto* const forward = std::get_if<Forward>(&answer)) {
        ++context_.statistics.forwarded;
        forwarding_ = std::make_unique<Forwarding>(stream_.socket().get_executor(), context_.upstreams,
                                                   context_.forwardings, std::move(*forward), reader_,
                                                   request, std::move(kept_upstream_));
        return Next::forward;
    }
    append_handshake_answer(out_, request.header("Sec-WebSocket-Key"));
    return Next::websocket;
}

void HttpConnection::name_client(IncomingRequest& request)
{
    if (peer_.is_proxy())
        read_forwarded(request.headers);
    request.peer = peer_.address;
    request.client = client();
    request.quota_key = quota_key();
    request.is_from_proxy = peer_.is_proxy();
}

/// What the proxy said of its last request does not hold for this one.
void HttpConnection::read_forwarded(core::HeaderFields fields)
{
    client_.clear();
    client_quota_key_.clear();
    if (!reader_.is_forwarded())
        return;
    auto const client = core::forwarded_client(fields, context_.proxies);
    if (!client)
        return;
    client_ = client->text();
    if (!context_.proxies.contains(*client))
        client_quota_key_ = client->is_v4() ? client_ : client->quota_key();
}

/// Whether the client may have one more WebSocket. One that came without a proxy has been counted since it
/// was accepted; those of a proxy are counted here, where it is known whose they are.
bool HttpConnection::admit_client()
{
    return !peer_.is_proxy() || context_.limit.admit(client_quota_key_, ticket_);
}

/// There are too many connections: of this client (429), or of all (503).
HttpConnection::Next HttpConnection::refuse_connection(int status, IncomingRequest const& request)
{
    auto refusal = sentence_response(status, too_many_connections);
    context_.endpoint->dress(refusal, request);
    return give(refusal, request);
}

HttpConnection::Next HttpConnection::give(HttpResponse const& response, IncomingRequest const& request)
{
    // Whatever answers 429 logs it itself, once: there may be thousands of these a second.
    if (response.status >= 400 && response.status != 429)
        context_.log.warning(LogCause("answer", client()),
                             concat(std::to_string(response.status), " ", request.method, " ",
                                    core::printable(core::without_keys(request.path), 200), " (", client(),
                                    ")"));
    bool const stays_open = reader_.keep_alive() && !stopping_;
    if (response.shared) {
        body_rest_ = encoded(*response.shared, request.header("Accept-Encoding"));
        append_shared_head(out_, response, stays_open, body_rest_);
        if (request.method != "HEAD" && !body_rest_.empty())
            body_ = response.shared;
        return stays_open ? Next::request : Next::close;
    }
    append_response(out_, response, stays_open, request.method != "HEAD");
    return stays_open ? Next::request : Next::close;
}

/// Sends all that is to be sent if that is possible without waiting, as it almost always is.
bool HttpConnection::flush_at_once()
{
    boost::system::error_code error;
    out_.erase(0, stream_.try_write(out_, error));
    if (out_.empty() && body_) {
        body_rest_.remove_prefix(stream_.try_write(body_rest_, error));
        if (body_rest_.empty())
            body_.reset();
    }
    return out_.empty() && !body_;
}

asio::awaitable<bool> HttpConnection::flush()
{
    set_deadline(context_.params.write_timeout);
    auto error = co_await stream_.write(out_);
    out_.clear();
    if (body_ && !error)
        error = co_await stream_.write(body_rest_);
    body_.reset();
    co_return !error && !is_cut_;
}

asio::awaitable<void> HttpConnection::refuse(int status, std::string_view what, std::string_view advice)
{
    ++refusal_counter(context_.statistics, status);
    context_.log.warning(LogCause("request", peer_.address),
                         concat(std::to_string(status), " for ", what, " (", peer_.address, ")"));
    append_response(out_, sentence_response(status, advice), false, true);
    set_deadline(context_.params.header_timeout);
    bool const sent = co_await flush();
    if (!sent)
        co_return;
    // Closing with unread bytes would reset the connection, and the answer with it: read a little, then
    // close.
    stream_.shut_down();
    for (int i = 0; i < max_drained; ++i) {
        reader_.discard();
        auto const space = reader_.prepare();
        auto const outcome = co_await stream_.read_some(asio::buffer(space.data(), space.size()));
        if (outcome.first)
            break;
    }
}

void HttpConnection::cut()
{
    is_cut_ = true;
    if (awaiting_request_) // all answers have been sent
        stream_.say_end();
    stream_.close();
    if (forwarding_)
        forwarding_->end();
    if (relay_)
        context_.tunnels.cut(*relay_);
}

void HttpConnection::stop()
{
    stopping_ = true;
    if (awaiting_request_)
        cut();
}

void HttpConnection::check(TimePoint now)
{
    if (kept_upstream_ && kept_upstream_->is_overdue(now))
        kept_upstream_.reset();
    if (now < deadline_ || is_cut_)
        return;
    if (awaiting_answer_) // it is not the browser that is late
        return forwarding_->give_up();
    ++context_.statistics.timed_out;
    if (awaiting_request_ && reader_.has_begun()) {
        std::string text;
        append_response(text, HttpResponse(408, {}, {}), false, true);
        boost::system::error_code ignored;
        stream_.try_write(text, ignored);
    }
    cut();
}

ChannelInfo HttpConnection::channel_info() const
{
    ChannelInfo info;
    info.path = reader_.request().path;
    info.query = reader_.request().query;
    info.asked = core::asked_address(reader_.request().headers, peer_.is_proxy());
    info.peer = peer_.address;
    info.client = client();
    info.quota_key = quota_key();
    info.public_address = reader_.request().header(core::public_address_header);
    info.is_from_proxy = peer_.is_proxy();
    return info;
}

} // namespace webots_cloud::adapters
