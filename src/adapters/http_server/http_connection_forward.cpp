// Requests that another server answers.
#include "http_connection.hpp"

#include "adapters/messages/http_response_text.hpp"
#include "adapters/messages/websocket_frames.hpp"
#include "adapters/messages/websocket_handshake.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

// The files of a page follow each other sooner, and the other server keeps its side longer.
constexpr auto keep_upstream_for = std::chrono::seconds(5);

constexpr std::string_view gateway_closed =
    "What you asked for has just ended. Please reload the page, or start again.\r\n";
constexpr std::string_view bad_gateway =
    "The server that has the answer can't be reached. Please try again in a moment.\r\n";
constexpr std::string_view late_gateway =
    "The server that has the answer does not give it. Please try again in a moment.\r\n";

} // namespace

/// Has another server answer the request. In this order: connect, ask, give the browser what has come, and
/// relay the rest in a tunnel, if there is any.
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
    // A kept connection may have been closed just when we used it. Only then there is a second round, with a
    // new one: nothing of an answer has come, so nothing is asked twice.
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
    // Refused after all: the refusal is among what is to be sent.
    if (!forwarding_)
        co_return next;
    bool const is_kept = next == Next::request && forwarding_->may_be_kept();
    auto upstream = forwarding_->upstream();
    // All of it came with the head: no tunnel is needed.
    if (rest_of_answer_ == 0) {
        if (is_kept)
            keep_upstream(std::move(upstream), forwarding_->release_socket());
        forwarding_.reset();
        co_return next;
    }
    // The tunnel takes both connections, and gives the browser's back only where all has arrived: without
    // that, the browser can't tell where the next answer begins.
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

/// Tells the browser that it failed, and the operator why.
HttpConnection::Next HttpConnection::fail_to_forward(Failure const& why)
{
    auto const destination = forwarding_->destination();
    forwarding_.reset();
    // Ended, as simulations do: that is no news for the operator.
    if (why != errc::closed)
        context_.log.warning(LogCause("forward", destination),
                             concat("Can't pass a request on to ", destination, ": ", why.message()));
    if (why == errc::unavailable)
        return refuse_connection(503, reader_.request());
    bool const is_late = why == errc::timed_out;
    ++(is_late ? context_.statistics.late_gateways : context_.statistics.bad_gateways);
    auto const sentence = is_late ? late_gateway : why == errc::closed ? gateway_closed : bad_gateway;
    auto refusal = sentence_response(is_late ? 504 : 502, sentence);
    context_.endpoint->dress(refusal, reader_.request());
    return give(refusal, reader_.request());
}

/// Appends the other server's answer, as much of it as there is, to what is to be sent.
HttpConnection::Next HttpConnection::begin_answer()
{
    using Body = ForwardedResponse::Body;
    auto const& response = forwarding_->response();
    if (forwarding_->is_in_messages())
        return begin_messages();
    bool const is_lasting = response.body() != Body::none && response.body() != Body::counted;
    // An answer without a known end holds its connection as a WebSocket does, and counts as one. Handshakes
    // have been counted already.
    if (is_lasting && !forwarding_->is_upgrade() && !admit_client()) {
        forwarding_.reset();
        return refuse_connection(429, reader_.request());
    }
    bool const stays_open = !is_lasting && reader_.keep_alive() && !stopping_;
    response.append_head(out_, stays_open);
    auto begun = forwarding_->begun_body();
    rest_of_answer_ = TunnelPlan::until_the_end;
    chunks_.reset();
    if (response.body() == Body::chunked)
        begun = begun.substr(0, chunks_.emplace().take(begun));
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

/// Accepts the browser's handshake, with the beginning of the other server's answer.
HttpConnection::Next HttpConnection::begin_messages()
{
    using Body = ForwardedResponse::Body;
    auto const& response = forwarding_->response();
    if (response.status() != 200 || response.body() == Body::none || response.body() == Body::chunked)
        return fail_to_forward(Failure(errc::protocol_error,
                                       concat("its answer, with status ", std::to_string(response.status()),
                                              ", can't be sent on in a WebSocket")));
    append_handshake_answer(out_, reader_.request().header("Sec-WebSocket-Key"));
    if (auto const begun = forwarding_->begun_body(); !begun.empty())
        out_.append(binary_frame_header(begun.size())).append(begun);
    rest_of_answer_ = TunnelPlan::until_the_end;
    chunks_.reset();
    return Next::tunnel;
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
    bool const is_in_messages = forwarding_->is_in_messages();
    bool const is_websocket = forwarding_->response().body() == ForwardedResponse::Body::websocket;
    auto plan = plan_tunnel();
    plan.is_two_way = is_websocket;
    plan.in_messages = is_in_messages;
    plan.chunks = chunks_;
    if (is_websocket)
        plan.to_upstream = reader_.rest();
    plan.ticket = std::move(ticket_);
    return plan;
}

} // namespace webots_cloud::adapters
