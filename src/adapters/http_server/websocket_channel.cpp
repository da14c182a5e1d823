// WebSockets of browsers, of which thousands may be idle: a silent one has no buffer, and a hostile one gets
// few messages in each turn of the event loop. Frames are understood by websocket_frames.cpp.
#include "websocket_channel.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <boost/asio/bind_allocator.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <array>
#include <memory_resource>
#include <numeric>
#include <optional>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

namespace {

// Maximum number of messages that are read ahead, and so handled in one turn of the event loop; more are left
// in the socket.
constexpr std::size_t max_received = 16;

// A whole record of TLS: nothing is left inside OpenSSL, where no wait would find it.
constexpr std::size_t scratch_size = 16 * 1024;

// What is sent to one channel after the other needs no memory of its own for each: up to this size, that of
// the last one is used again.
constexpr std::size_t max_spare = 4096;

std::string& spare_memory()
{
    thread_local std::string spare; // empty
    return spare;
}

} // namespace

WebSocketChannel::WebSocketChannel(NetworkStream stream, HttpServerParams const& params,
                                   HttpServerStatistics& statistics)
    : params_(params), stream_(std::move(stream)), statistics_(statistics),
      last_heard_(std::chrono::steady_clock::now()), frames_(params.message_bytes),
      changed_(stream_.socket().get_executor(), TimePoint::max())
{}

void WebSocketChannel::start(std::string_view received)
{
    take(received);
    read_on();
}

/// After bytes that were not read by `read`: a record of TLS may hold more, which no wait would find.
void WebSocketChannel::read_on()
{
    if (stream_.is_tls() && !unread_)
        read();
    else
        await_bytes();
}

bool WebSocketChannel::is_full() const noexcept
{
    auto const bytes =
        std::accumulate(received_.begin(), received_.end(), std::size_t{0},
                        [](std::size_t sum, std::string const& message) { return sum + message.size(); });
    return received_.size() >= max_received || bytes > params_.message_bytes;
}

void WebSocketChannel::await_bytes()
{
    if (awaiting_read_ || lost_ || (!closing_ && is_full()))
        return;
    awaiting_read_ = true;
    if (unread_) // what was left of the last read comes in a turn of its own: other browsers first
        return asio::post(stream_.socket().get_executor(), [this] {
            awaiting_read_ = false;
            if (lost_)
                return cut();
            auto const rest = std::move(unread_);
            take(*rest);
            read_on();
        });
    auto resume = [this](boost::system::error_code error) {
        awaiting_read_ = false;
        if (error || lost_)
            cut();
        else
            read();
    };
    // It may wait for hours, in memory of just its size: Asio would lend it the larger block of an accept.
    stream_.wait_to_read(asio::bind_allocator(std::pmr::polymorphic_allocator<>(), std::move(resume)));
}

void WebSocketChannel::read()
{
    thread_local std::array<char, scratch_size> scratch;
    boost::system::error_code error;
    auto const size = stream_.try_read(asio::buffer(scratch), error);
    if (error && error != asio::error::would_block)
        return cut();
    if (!error) {
        last_heard_ = std::chrono::steady_clock::now();
        if (awaits_pong())
            deadline_ = TimePoint::max();
        take(std::string_view(scratch.data(), size));
    }
    await_bytes();
}

void WebSocketChannel::take(std::string_view bytes)
{
    std::optional<std::string> ping;
    while (!bytes.empty() && !broken_ && !close_received_ && (closing_ || !is_full())) {
        auto event = frames_.next(bytes);
        if (event.kind == WebSocketEvent::Kind::ping)
            ping = std::move(event.payload);
        else
            obey(std::move(event));
    }
    if (!bytes.empty() && !broken_ && !close_received_)
        unread_ = std::make_unique<std::string>(bytes);
    // Of several pings the last one is answered (RFC 6455, 5.5.3): a browser can't make us write for each
    // frame.
    if (ping && !closing_ && outgoing_.size() < params_.queue_bytes)
        append_pong_frame(outgoing_, *ping);
    if (ping)
        write();
}

void WebSocketChannel::obey(WebSocketEvent event)
{
    switch (event.kind) {
    case WebSocketEvent::Kind::need_more:
    case WebSocketEvent::Kind::ping:
    case WebSocketEvent::Kind::pong:
        break;
    case WebSocketEvent::Kind::message:
        if (!closing_)
            received_.push_back(std::move(event.payload));
        notify();
        break;
    case WebSocketEvent::Kind::close:
        close_received_ = true;
        farewell_ = closing_ ? std::uint16_t{0} : static_cast<std::uint16_t>(event.code);
        begin_close(static_cast<std::uint16_t>(event.code), {});
        break;
    case WebSocketEvent::Kind::fault:
        ++statistics_.bad_frames;
        broken_ = true;
        begin_close(static_cast<std::uint16_t>(event.code), {});
        break;
    }
}

void WebSocketChannel::write()
{
    if (awaiting_write_ || lost_)
        return;
    std::string_view rest = outgoing_;
    boost::system::error_code error;
    while (!rest.empty() && !error)
        rest.remove_prefix(stream_.try_write(rest, error));
    if (error && error != asio::error::would_block)
        return cut();
    if (rest.empty())
        return written();
    outgoing_.erase(0, outgoing_.size() - rest.size());
    awaiting_write_ = true;
    stream_.wait_to_write([this](boost::system::error_code failed) {
        awaiting_write_ = false;
        if (failed || lost_)
            cut();
        else
            write();
    });
}

void WebSocketChannel::written()
{
    if (outgoing_.capacity() <= max_spare) {
        outgoing_.clear();
        spare_memory().swap(outgoing_);
    }
    outgoing_ = std::string(); // and its memory
    if (close_received_ || broken_)
        stream_.shut_down(); // what a broken browser still sends is read and forgotten, lest the close frame
                             // be lost
    if (close_received_)
        cut(); // RFC 6455, 7.1.1: the server ends the connection
}

result<> WebSocketChannel::send_all(std::span<std::string const> texts)
{
    if (closing_ || lost_)
        return Failure(errc::closed);
    if (outgoing_.empty())
        outgoing_.swap(spare_memory());
    for (auto const& text : texts) {
        if (outgoing_.size() + text.size() > params_.queue_bytes) {
            ++statistics_.slow_readers;
            cut();
            return Failure(errc::too_large, "the browser does not read what it is sent");
        }
        append_text_frame(outgoing_, text);
    }
    write();
    return {};
}

std::size_t WebSocketChannel::queued() noexcept
{
    return outgoing_.size() + (lost_ ? 0 : stream_.unsent());
}

asio::awaitable<result<std::string>> WebSocketChannel::receive()
{
    while (received_.empty()) {
        if (closing_ && !broken_)
            co_return Failure(errc::closed);
        if (broken_ || lost_)
            co_return Failure(errc::unreachable, why_lost());
        (void)co_await changed_.async_wait(asio::as_tuple(asio::deferred));
        auto const state = co_await asio::this_coro::cancellation_state;
        if (state.cancelled() != asio::cancellation_type::none)
            co_return Failure(asio::error::operation_aborted);
    }
    co_return take_message();
}

std::string WebSocketChannel::take_message()
{
    auto message = std::move(received_.front());
    received_.erase(received_.begin());
    if (received_.empty())
        received_ = {};
    await_bytes();
    return message;
}

void WebSocketChannel::close(std::uint16_t code, std::string reason)
{
    if (closing_)
        return;
    received_.clear();
    begin_close(code, reason);
    await_bytes();
}

void WebSocketChannel::begin_close(std::uint16_t code, std::string_view reason)
{
    if (!closing_) {
        closing_ = true;
        deadline_ = std::chrono::steady_clock::now() + params_.header_timeout;
        append_close_frame(outgoing_, code, reason);
    }
    notify();
    write();
}

asio::awaitable<void> WebSocketChannel::finish()
{
    close();
    // Handlers that are still to come point to this channel.
    while (!lost_ || awaiting_read_ || awaiting_write_)
        (void)co_await changed_.async_wait(asio::as_tuple(asio::deferred));
}

std::string WebSocketChannel::why_lost() const
{
    if (broken_) // for instance a close frame that is not masked: the goodbye of a proxy, not of the browser
        return "what came last was not from a browser: a proxy in between may have closed the connection";
    if (!silent_)
        return "the connection broke without a close frame";
    auto const patience = params_.network.ping_after() + params_.network.pong_timeout();
    return core::concat("the browser answered no ping for ", core::seconds_rounded_up(patience),
                        " s: it may be asleep, or its network gone (\"pingTimeout\")");
}

void WebSocketChannel::cut()
{
    lost_ = true;
    outgoing_ = std::string();
    unread_.reset();
    stream_.close();
    notify();
}

void WebSocketChannel::check(TimePoint now)
{
    if (lost_)
        return;
    if (now >= deadline_) {
        silent_ = !closing_;
        statistics_.dead_peers += silent_ ? 1 : 0;
        return cut();
    }
    if (closing_)
        return;
    if (!awaiting_read_)
        last_heard_ = now; // it may have said much; it is we who do not listen
    if (now - std::max(last_heard_, last_pinged_) < params_.network.ping_after())
        return;
    last_pinged_ = now;
    if (!awaits_pong() && params_.network.pong_timeout() > Duration::zero())
        deadline_ = now + params_.network.pong_timeout();
    if (outgoing_.empty())
        append_ping_frame(outgoing_);
    write();
}

} // namespace webots_cloud::adapters
