#include "http_connection.hpp"

#include "core/simulation/gateway_address.hpp"
#include "core/simulation/public_base.hpp"
#include "core/text.hpp"
#include "http_response_text.hpp"
#include "websocket_handshake.hpp"

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
// The files of a page follow each other sooner, and the other server keeps its side longer.
constexpr auto keep_upstream_for = std::chrono::seconds(5);

constexpr std::string_view speaks_https =
    "This port speaks HTTPS: put https:// (or wss://) in front of the address.\r\n";

constexpr std::string_view too_many_connections = "Too many connections. Please try again in a moment.\r\n";

constexpr std::string_view no_memory = "The server is busy. Please try again in a moment.\r\n";

constexpr std::string_view html = "text/html; charset=UTF-8";

constexpr std::string_view gateway_closed =
    "What you asked for has just ended. Please reload the page, or start again.\r\n";
constexpr std::string_view bad_gateway =
    "The server that has the answer can't be reached. Please try again in a moment.\r\n";
constexpr std::string_view late_gateway =
    "The server that has the answer does not give it. Please try again in a moment.\r\n";

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
        auto const failed = co_await stream_.handshake();
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
    auto const begun = reader_.rest().substr(
        0, static_cast<std::size_t>(std::min<std::uint64_t>(length, reader_.rest().size())));
    if (!body->has_room(begun.size())) {
        body.reset();
        co_await refuse(503, "a body, for which there is no memory", no_memory);
        co_return false;
    }
    body->append(begun);
    reader_.skip(begun.size());
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
    if (request.upgrade && !admit_client())
        return refuse_connection(request);
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

HttpConnection::Next HttpConnection::refuse_connection(IncomingRequest const& request)
{
    HttpResponse refusal(429, std::string(html), std::string(too_many_connections));
    refusal.headers.emplace_back("Retry-After", "5");
    return give(refusal, request);
}

/// Has another server answer the request.
asio::awaitable<HttpConnection::Next> HttpConnection::forward()
{
    if (!out_.empty()) { // answers to earlier requests do not wait for another server
        bool sent = flush_at_once();
        if (!sent)
            sent = co_await flush();
        if (!sent)
            co_return Next::close;
    }
    if (!context_.has_room())
        co_return fail_to_forward(Failure(errc::unavailable, "there is no room for one more connection"));
    awaiting_answer_ = true;
    result<> reached;
    do {
        set_deadline(context_.params.connect_timeout);
        reached = co_await forwarding_->connect();
        if (reached && !is_cut_) {
            set_deadline(context_.params.answer_timeout);
            reached = co_await forwarding_->ask();
            count_forwarded(forwarding_->request_size(), 0);
        }
    } while (!reached && !is_cut_ && forwarding_->was_closed_meanwhile());
    awaiting_answer_ = false;
    if (is_cut_)
        co_return Next::close;
    if (!reached)
        co_return fail_to_forward(reached.error());
    auto const next = begin_answer();
    if (next == Next::tunnel)
        co_return next;
    if (!forwarding_)
        co_return next;
    bool const is_kept = next == Next::request && forwarding_->may_be_kept();
    auto upstream = forwarding_->upstream();
    if (rest_of_answer_ == 0) {
        if (is_kept)
            keep_upstream(std::move(upstream), forwarding_->release_socket());
        forwarding_.reset();
        co_return next;
    }
    auto plan = plan_tunnel();
    plan.length = rest_of_answer_;
    plan.keeps_upstream = is_kept;
    deadline_ = TimePoint::max(); // from here on the tunnel has its own
    auto ends = co_await context_.tunnels.relay(std::move(plan), relay_);
    if (ends.upstream.descriptor >= 0)
        keep_upstream(std::move(upstream), std::move(ends.upstream));
    if (ends.browser.descriptor < 0)
        co_return Next::close;
    stream_.restore(std::move(ends.browser));
    co_return is_cut_ ? Next::close : next;
}

/// Says so to the browser, and why to the operator.
HttpConnection::Next HttpConnection::fail_to_forward(Failure const& why)
{
    auto const destination = forwarding_->destination();
    forwarding_.reset();
    if (why != errc::closed)
        context_.log.warning(LogCause("forward", destination),
                             concat("Can't pass a request on to ", destination, ": ", why.message()));
    if (why == errc::unavailable) {
        HttpResponse response(503, std::string(html), std::string(too_many_connections));
        response.headers.emplace_back("Retry-After", "5");
        return give(response, reader_.request());
    }
    bool const is_late = why == errc::timed_out;
    ++(is_late ? context_.statistics.late_gateways : context_.statistics.bad_gateways);
    auto const sentence = is_late ? late_gateway : why == errc::closed ? gateway_closed : bad_gateway;
    HttpResponse const response(is_late ? 504 : 502, std::string(html), std::string(sentence));
    return give(response, reader_.request());
}

/// Appends the other server's answer, as much of it as there is, to what is to be sent.
HttpConnection::Next HttpConnection::begin_answer()
{
    using Body = ForwardedResponse::Body;
    auto const& response = forwarding_->response();
    bool const is_lasting = response.body() == Body::endless || response.body() == Body::websocket;
    // Handshakes have been counted already.
    if (is_lasting && !forwarding_->is_upgrade() && !admit_client()) {
        forwarding_.reset();
        return refuse_connection(reader_.request());
    }
    bool const stays_open = !is_lasting && reader_.keep_alive() && !stopping_;
    response.append_head(out_, stays_open);
    auto begun = forwarding_->begun_body();
    rest_of_answer_ = TunnelPlan::until_the_end;
    if (!is_lasting) {
        begun = begun.substr(
            0, static_cast<std::size_t>(std::min<std::uint64_t>(response.length(), begun.size())));
        rest_of_answer_ = response.length() - begun.size();
    }
    out_.append(begun);
    if (rest_of_answer_ == 0)
        count_forwarded(0, out_.size());
    return is_lasting ? Next::tunnel : stays_open ? Next::request : Next::close;
}

void HttpConnection::count_forwarded(std::size_t received, std::size_t sent)
{
    context_.statistics.tunnel_bytes_received += received;
    context_.statistics.tunnel_bytes_sent += sent;
    if (auto const& group = forwarding_->group()) {
        group->count_received(received);
        group->count_sent(sent);
    }
}

void HttpConnection::keep_upstream(Upstream upstream, NetworkStream::Released connection)
{
    auto const until = std::chrono::steady_clock::now() + keep_upstream_for;
    kept_upstream_ = std::make_unique<KeptUpstream>(std::move(upstream), std::move(connection), until,
                                                    context_.forwardings);
}

TunnelPlan HttpConnection::plan_tunnel()
{
    TunnelPlan plan;
    plan.browser = stream_.release();
    plan.upstream = forwarding_->release_socket();
    plan.to_browser = std::move(out_);
    plan.group = forwarding_->group();
    out_.clear();
    forwarding_.reset();
    return plan;
}

TunnelPlan HttpConnection::take_tunnel()
{
    bool const is_websocket = forwarding_->response().body() == ForwardedResponse::Body::websocket;
    auto plan = plan_tunnel();
    plan.is_two_way = is_websocket;
    if (is_websocket)
        plan.to_upstream = reader_.rest();
    plan.ticket = std::move(ticket_);
    return plan;
}

HttpConnection::Next HttpConnection::give(HttpResponse const& response, IncomingRequest const& request)
{
    // Whatever answers 429 logs it itself, once: there may be thousands of these a second.
    if (response.status >= 400 && response.status != 429)
        context_.log.warning(LogCause("answer", client()),
                             concat(std::to_string(response.status), " ", request.method, " ",
                                    core::printable(core::without_token(request.path), 200), " (", client(),
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
    HttpResponse response(status, "text/html; charset=UTF-8", std::string(advice));
    if (status == 503)
        response.headers.emplace_back("Retry-After", "5");
    context_.log.warning(LogCause("request", peer_.address),
                         concat(std::to_string(status), " for ", what, " (", peer_.address, ")"));
    append_response(out_, response, false, true);
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
    info.host = reader_.request().header("Host");
    info.peer = peer_.address;
    info.client = client();
    info.quota_key = quota_key();
    info.public_address = reader_.request().header(core::public_address_header);
    info.is_from_proxy = peer_.is_proxy();
    return info;
}

} // namespace webots_cloud::adapters
