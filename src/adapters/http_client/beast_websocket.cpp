// WebSockets of our servers to others, as client, with Boost.Beast. A few messages are read ahead, sending is
// a bounded queue, and silence is answered by a ping, then by the end. The server's side is
// websocket_channel.cpp.
#include "client_stream.hpp"
#include "core/text.hpp"
#include "server_connection.hpp"

#include <webots_cloud/adapters/http_client.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>

#include <algorithm>
#include <deque>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using adapters::ClientStream;
using adapters::ServerTarget;
using core::concat;

// Messages that are read ahead; more are left in the socket until the caller has received some.
constexpr std::size_t max_read_ahead = 16;

// Of the buffer of messages, kept for the next one, in bytes.
constexpr std::size_t usual_message = 4096;

// For the other side to take what is queued and our close frame, and to answer it.
constexpr auto close_timeout = std::chrono::seconds(5);

// Without a word from the other side; after half of it, it is pinged. As long as our own servers wait.
constexpr auto silence_timeout = std::chrono::seconds(60);

// RFC 6455, 5.5.1
constexpr std::size_t max_close_reason = 123;

/// A WebSocket that is open, or about to be. Operations that are under way share it, so that it outlives the
/// channel for as long as they need to end.
class OpenWebSocket final : public std::enable_shared_from_this<OpenWebSocket>
{
public:
    /// Plain without `tls`.
    OpenWebSocket(WebSocketRequest const& request, asio::any_io_executor const& executor,
                  asio::ssl::context* tls)
        : stream_(executor, tls), changed_(executor, TimePoint::max()), closing_deadline_(executor),
          max_message_(request.max_message), max_queued_(request.max_queued)
    {}

    ClientStream& connection() { return stream_.next_layer(); }

    asio::awaitable<result<>> shake_hands(WebSocketRequest const& request, ServerTarget const& target,
                                          TimePoint deadline);

    /// Begins to read.
    void start() { read(); }

    result<> send(std::string text);
    asio::awaitable<result<std::string>> receive();
    void close(std::uint16_t code, std::string reason);
    std::size_t queued() const noexcept { return queued_bytes_; }
    std::uint16_t farewell() const noexcept { return farewell_; }

    /// Nobody will ask any more.
    void abandon()
    {
        if (!closing_)
            end(Failure(errc::closed));
    }

private:
    void set_limits(WebSocketRequest const& request, TimePoint deadline);
    void read();
    void take_read(beast::error_code error);
    void take_message();
    bool is_full() const noexcept
    {
        return received_.size() >= max_read_ahead || received_bytes_ > max_message_;
    }
    void write();
    void take_written(beast::error_code error);
    void send_close();
    void end(Failure why);
    void end_of_reading(beast::error_code error);
    void notify() { changed_.cancel(); }

    websocket::stream<ClientStream, false> stream_;
    asio::steady_timer changed_; ///< Never expires: `notify` cancels it to wake who receives.
    asio::steady_timer closing_deadline_;
    std::size_t max_message_;
    std::size_t max_queued_;
    beast::flat_buffer incoming_;      ///< The message that is being read.
    std::deque<std::string> received_; ///< Not yet by the caller.
    std::size_t received_bytes_ = 0;
    std::deque<std::string> outgoing_; ///< The first is being sent while `is_writing_`.
    std::size_t queued_bytes_ = 0;
    websocket::close_reason goodbye_; ///< Ours.
    std::uint16_t farewell_ = 0;      ///< The code of the other side.
    Failure end_;                     ///< Why nothing more comes, once `has_ended_`.
    bool is_reading_ = false;
    bool is_writing_ = false;
    bool close_came_ = false;  ///< From the other side.
    bool closing_ = false;     ///< By us.
    bool sends_close_ = false; ///< What was queued before it has been sent.
    bool has_ended_ = false;
};

/// What a message that waits counts for: many empty ones take memory, too.
std::size_t weight(std::string const& message)
{
    return message.size() + sizeof message;
}

std::string host_field(ServerTarget const& target)
{
    bool const is_v6 = target.host.find(':') != std::string::npos;
    auto field = is_v6 ? concat("[", target.host, "]") : target.host;
    if (!target.has_usual_port())
        field.append(":").append(std::to_string(target.port));
    return field;
}

Failure handshake_failure(beast::error_code error, websocket::response_type const& answer)
{
    if (error == beast::error::timeout)
        return Failure(errc::timed_out, "no answer to the handshake in time");
    if (error == asio::error::operation_aborted)
        return Failure(error);
    if (error == websocket::error::upgrade_declined)
        return Failure(errc::protocol_error,
                       concat("it opens no WebSocket, but answers ", std::to_string(answer.result_int()), " ",
                              core::printable({answer.reason().data(), answer.reason().size()}, 80)));
    if (error.category() == beast::error_code(websocket::error::closed).category() ||
        error.category() == beast::error_code(http::error::end_of_stream).category())
        return Failure(errc::protocol_error, concat("it opens no WebSocket: ", error.message()));
    return Failure(errc::unreachable, error.message());
}

void OpenWebSocket::set_limits(WebSocketRequest const& request, TimePoint deadline)
{
    auto const left =
        std::max<Duration>(deadline - std::chrono::steady_clock::now(), std::chrono::milliseconds(1));
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = left;
    timeout.idle_timeout = silence_timeout;
    timeout.keep_alive_pings = true;
    stream_.set_option(timeout);
    stream_.set_option(websocket::stream_base::decorator([&request](websocket::request_type& handshake) {
        handshake.set(http::field::user_agent, "webots_cloud");
        for (auto const& [name, value] : request.headers) {
            if (equal_ignoring_case(name, "Host"))
                handshake.set(http::field::host, value);
            else
                handshake.insert(name, value);
        }
    }));
    stream_.read_message_max(request.max_message);
    stream_.auto_fragment(false); // a message is one frame
    stream_.text(true);
    stream_.control_callback([this](websocket::frame_type kind, beast::string_view) {
        close_came_ = close_came_ || kind == websocket::frame_type::close;
    });
}

asio::awaitable<result<>> OpenWebSocket::shake_hands(WebSocketRequest const& request,
                                                     ServerTarget const& target, TimePoint deadline)
{
    connection().lowest().expires_never(); // from here on the WebSocket's own deadlines count
    set_limits(request, deadline);
    websocket::response_type answer;
    auto const host = host_field(target);
    auto const [error] =
        co_await stream_.async_handshake(answer, host, target.path, asio::as_tuple(asio::use_awaitable));
    // The decorator refers to `request`, which does not live as long as the WebSocket.
    stream_.set_option(websocket::stream_base::decorator([](websocket::request_type&) {}));
    if (error)
        co_return handshake_failure(error, answer);
    // From here on Beast takes this one for the handshake that closes.
    websocket::stream_base::timeout timeout{};
    stream_.get_option(timeout);
    timeout.handshake_timeout = close_timeout;
    stream_.set_option(timeout);
    co_return result<>();
}

void OpenWebSocket::read()
{
    if (is_reading_ || has_ended_ || closing_ || is_full())
        return;
    is_reading_ = true;
    stream_.async_read(incoming_, [self = shared_from_this()](beast::error_code error, std::size_t) {
        self->take_read(error);
    });
}

void OpenWebSocket::take_read(beast::error_code error)
{
    is_reading_ = false;
    if (error)
        return end_of_reading(error);
    if (!closing_ && !has_ended_)
        take_message();
    read();
}

void OpenWebSocket::take_message()
{
    received_.push_back(beast::buffers_to_string(incoming_.data()));
    received_bytes_ += incoming_.size();
    incoming_.clear();
    if (incoming_.capacity() > usual_message)
        incoming_.shrink_to_fit();
    notify();
}

void OpenWebSocket::end_of_reading(beast::error_code error)
{
    if (closing_ || has_ended_)
        return;
    // What the WebSocket says of the other side's frames: it has been sent a close frame with the reason.
    bool const is_refused = error.category() == beast::error_code(websocket::error::closed).category();
    if (close_came_) {
        farewell_ = static_cast<std::uint16_t>(stream_.reason().code);
        end(Failure(errc::closed));
    } else if (is_refused)
        end(Failure(errc::closed, error.message()));
    else if (error == beast::error::timeout)
        end(Failure(errc::unreachable, "the other side answered no ping"));
    else
        end(Failure(errc::unreachable,
                    concat("the connection broke without a close frame: ", error.message())));
}

result<> OpenWebSocket::send(std::string text)
{
    if (closing_ || has_ended_)
        return Failure(errc::closed);
    if (queued_bytes_ + weight(text) > max_queued_) {
        end(Failure(errc::unreachable, "the other side did not read what it was sent"));
        return Failure(errc::too_large, "the other side does not read what it is sent");
    }
    queued_bytes_ += weight(text);
    outgoing_.push_back(std::move(text));
    write();
    return {};
}

void OpenWebSocket::write()
{
    if (is_writing_ || has_ended_)
        return;
    if (outgoing_.empty()) {
        if (closing_)
            send_close();
        return;
    }
    is_writing_ = true;
    stream_.async_write(
        asio::buffer(outgoing_.front()),
        [self = shared_from_this()](beast::error_code error, std::size_t) { self->take_written(error); });
}

void OpenWebSocket::take_written(beast::error_code error)
{
    is_writing_ = false;
    if (has_ended_)
        return outgoing_.clear();
    queued_bytes_ -= weight(outgoing_.front());
    outgoing_.pop_front();
    if (!error)
        return write();
    // After an error, what is read says why it ended: a close frame may be on its way.
    if (closing_)
        end(Failure(errc::closed));
}

asio::awaitable<result<std::string>> OpenWebSocket::receive()
{
    auto const self = shared_from_this();
    while (received_.empty()) {
        if (closing_)
            co_return Failure(errc::closed);
        if (has_ended_)
            co_return end_;
        auto const before = co_await asio::this_coro::cancellation_state;
        if (before.cancelled() != asio::cancellation_type::none)
            co_return Failure(asio::error::operation_aborted);
        (void)co_await changed_.async_wait(asio::as_tuple(asio::deferred));
        auto const after = co_await asio::this_coro::cancellation_state;
        if (after.cancelled() != asio::cancellation_type::none)
            co_return Failure(asio::error::operation_aborted);
    }
    auto message = std::move(received_.front());
    received_.pop_front();
    received_bytes_ -= message.size();
    read();
    co_return message;
}

void OpenWebSocket::close(std::uint16_t code, std::string reason)
{
    if (closing_ || has_ended_)
        return;
    closing_ = true;
    received_.clear();
    received_bytes_ = 0;
    reason.resize(std::min(reason.size(), max_close_reason));
    while (!core::is_utf8(reason)) // cut within a character
        reason.pop_back();
    goodbye_ = websocket::close_reason(static_cast<websocket::close_code>(code), reason);
    closing_deadline_.expires_after(close_timeout);
    closing_deadline_.async_wait([weak = weak_from_this()](beast::error_code cancelled) {
        auto const self = weak.lock();
        if (self && !cancelled)
            self->end(Failure(errc::closed));
    });
    notify();
    write();
}

void OpenWebSocket::send_close()
{
    if (sends_close_)
        return;
    sends_close_ = true;
    stream_.async_close(goodbye_,
                        [self = shared_from_this()](beast::error_code) { self->end(Failure(errc::closed)); });
}

/// Cuts the connection, if it is still there. What is under way ends soon, and has no effect any more.
void OpenWebSocket::end(Failure why)
{
    if (has_ended_)
        return;
    has_ended_ = true;
    end_ = std::move(why);
    queued_bytes_ = 0;
    // The write that is under way reads from the first message: its handler clears them.
    if (!is_writing_)
        outgoing_.clear();
    closing_deadline_.cancel();
    connection().lowest().close();
    notify();
}

/// What the caller of `connect` has.
class ClientChannel final : public Channel
{
public:
    explicit ClientChannel(std::shared_ptr<OpenWebSocket> socket) : socket_(std::move(socket)) {}
    ~ClientChannel() override { socket_->abandon(); }

    result<> send(std::string text) override { return socket_->send(std::move(text)); }
    asio::awaitable<result<std::string>> receive() override { return socket_->receive(); }
    void close(std::uint16_t code, std::string reason) override { socket_->close(code, std::move(reason)); }
    std::size_t queued() noexcept override { return socket_->queued(); }
    std::uint16_t farewell() const noexcept override { return socket_->farewell(); }

private:
    std::shared_ptr<OpenWebSocket> socket_;
};

/// Opens WebSockets: resolves, connects, shakes hands, all before one deadline.
class BeastWebSocketClient final : public WebSocketClient
{
public:
    BeastWebSocketClient(asio::any_io_executor executor, HttpClientConfig config, Logger log)
        : executor_(std::move(executor)), servers_(executor_, std::move(config), std::move(log))
    {}

    asio::awaitable<result<std::unique_ptr<Channel>>> connect(WebSocketRequest request) override;

private:
    asio::awaitable<result<std::unique_ptr<Channel>>> open(WebSocketRequest const& request,
                                                           ServerTarget const& target,
                                                           std::vector<asio::ip::tcp::endpoint> addresses,
                                                           TimePoint deadline, asio::ssl::context* tls);

    asio::any_io_executor executor_;
    adapters::ServerDirectory servers_;
};

asio::awaitable<result<std::unique_ptr<Channel>>> BeastWebSocketClient::connect(WebSocketRequest request)
{
    auto const deadline = std::chrono::steady_clock::now() + request.timeout;
    auto target = adapters::parse_websocket_target(request.url);
    if (!target)
        co_return target.error();
    target->address = request.address;
    target->elsewhere = request.elsewhere;
    auto addresses = co_await servers_.resolve(*target, deadline);
    if (!addresses)
        co_return addresses.error();
    // A cancellation that came just as a step ended is lost to that step (HACKING.md, "Coroutines"), so each
    // of them is followed by a look.
    auto const state = co_await asio::this_coro::cancellation_state;
    if (state.cancelled() != asio::cancellation_type::none)
        co_return Failure(asio::error::operation_aborted);
    if (!target->tls)
        co_return co_await open(request, *target, std::move(*addresses), deadline, nullptr);
    auto context = servers_.tls();
    if (!context)
        co_return context.error();
    co_return co_await open(request, *target, std::move(*addresses), deadline, &*context);
}

asio::awaitable<result<std::unique_ptr<Channel>>>
BeastWebSocketClient::open(WebSocketRequest const& request, ServerTarget const& target,
                           std::vector<asio::ip::tcp::endpoint> addresses, TimePoint deadline,
                           asio::ssl::context* tls)
{
    auto const socket = std::make_shared<OpenWebSocket>(request, executor_, tls);
    auto& connection = socket->connection();
    connection.lowest().expires_at(deadline);
    auto const opened = co_await servers_.open_connection(connection.lowest(), connection.encrypted(), target,
                                                          std::move(addresses));
    if (!opened)
        co_return opened.error();
    auto const connected = co_await asio::this_coro::cancellation_state;
    if (connected.cancelled() != asio::cancellation_type::none)
        co_return Failure(asio::error::operation_aborted);
    auto const accepted = co_await socket->shake_hands(request, target, deadline);
    if (!accepted)
        co_return accepted.error();
    auto const state = co_await asio::this_coro::cancellation_state;
    if (state.cancelled() != asio::cancellation_type::none)
        co_return Failure(asio::error::operation_aborted);
    socket->start();
    std::unique_ptr<Channel> channel = std::make_unique<ClientChannel>(socket);
    co_return channel;
}

} // namespace

std::unique_ptr<WebSocketClient> make_websocket_client(asio::any_io_executor executor,
                                                       HttpClientConfig config, Logger log)
{
    return std::make_unique<BeastWebSocketClient>(std::move(executor), std::move(config), std::move(log));
}

} // namespace webots_cloud
