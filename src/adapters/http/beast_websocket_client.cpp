#include "async/wakeup.hpp"
#include "client_target.hpp"
#include "core/text.hpp"
#include "tls_trust.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/stream.hpp>

#include <openssl/ssl.h>

#include <deque>
#include <optional>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using adapters::Target;
using asio::ip::tcp;
using core::concat;

constexpr auto idle_time = std::chrono::seconds(60); // the peer is pinged after half of it
constexpr auto close_time = std::chrono::seconds(2); // for the peer's answer to a close frame
constexpr std::size_t max_unread = 64;               // messages; then nothing more is read

using PlainStream = websocket::stream<beast::tcp_stream, false>;
using TlsStream = websocket::stream<beast::ssl_stream<beast::tcp_stream>, false>;

/// Reads ahead a little and writes from a queue, so that sending never waits and closing needs no reader.
/// Shared with the operations under way, which end when it is dropped.
template<class Stream>
class Connection : public std::enable_shared_from_this<Connection<Stream>>
{
public:
    template<class... Arguments>
    explicit Connection(asio::any_io_executor const& executor, WebSocketRequest const& request,
                        Arguments&... arguments)
        : stream_(executor, arguments...), closing_(executor), heard_(executor),
          max_queued_(request.max_queued)
    {
        stream_.read_message_max(request.max_message);
        stream_.text(true);
    }

    Stream& stream() noexcept { return stream_; }

    void start()
    {
        websocket::stream_base::timeout timeout;
        timeout.handshake_timeout = websocket::stream_base::none(); // it is over
        timeout.idle_timeout = idle_time;
        timeout.keep_alive_pings = true;
        stream_.set_option(timeout);
        beast::get_lowest_layer(stream_).expires_never();
        read();
    }

    result<> send(std::string text)
    {
        if (ended_ || is_closing_)
            return Failure(errc::closed);
        queued_ += text.size();
        if (queued_ > max_queued_) {
            end(Failure(errc::unreachable, "it does not read what it is sent"));
            drop();
            return Failure(errc::too_large);
        }
        queue_.push_back(std::move(text));
        if (queue_.size() == 1)
            write();
        return {};
    }

    asio::awaitable<result<std::string>> receive()
    {
        while (inbox_.empty() && !ended_) {
            auto const woken = co_await heard_.wait();
            if (!woken)
                co_return woken.error();
        }
        if (inbox_.empty())
            co_return *ended_;
        auto text = std::move(inbox_.front());
        inbox_.pop_front();
        if (is_resting_ && !ended_) {
            is_resting_ = false;
            read();
        }
        co_return text;
    }

    void close(std::uint16_t code, std::string reason)
    {
        if (ended_ || is_closing_)
            return;
        is_closing_ = true;
        goodbye_ = websocket::close_reason(static_cast<websocket::close_code>(code), reason);
        if (queue_.empty())
            say_goodbye();
    }

    void drop()
    {
        closing_.cancel();
        beast::get_lowest_layer(stream_).close();
    }

    std::size_t queued() const noexcept { return queued_; }
    std::uint16_t farewell() const noexcept { return farewell_; }

private:
    void read()
    {
        stream_.async_read(buffer_, [self = this->shared_from_this()](beast::error_code error, std::size_t) {
            self->take(error);
        });
    }

    void take(beast::error_code error)
    {
        if (error)
            return end(error);
        inbox_.push_back(beast::buffers_to_string(buffer_.data()));
        buffer_.consume(buffer_.size());
        heard_.notify();
        is_resting_ = inbox_.size() >= max_unread;
        if (!is_resting_)
            read();
    }

    void write()
    {
        stream_.async_write(
            asio::buffer(queue_.front()),
            [self = this->shared_from_this()](beast::error_code error, std::size_t) { self->wrote(error); });
    }

    void wrote(beast::error_code error)
    {
        if (error)
            return end(error);
        queued_ -= queue_.front().size();
        queue_.pop_front();
        if (!queue_.empty())
            write();
        else if (is_closing_)
            say_goodbye();
    }

    /// While a read is under way, which ends when the peer has answered.
    void say_goodbye()
    {
        closing_.expires_after(close_time);
        closing_.async_wait([self = this->shared_from_this()](beast::error_code error) {
            if (!error)
                self->drop();
        });
        stream_.async_close(goodbye_, [self = this->shared_from_this()](beast::error_code error) {
            self->closing_.cancel();
            self->end(error ? error : beast::error_code(websocket::error::closed));
        });
    }

    void end(beast::error_code error)
    {
        if (error == websocket::error::closed) {
            farewell_ = is_closing_ ? 0 : static_cast<std::uint16_t>(stream_.reason().code);
            end(Failure(errc::closed));
        } else if (error == websocket::error::message_too_big) {
            end(Failure(errc::unreachable, "it has sent a message that is too long"));
        } else {
            end(Failure(errc::unreachable, error.message()));
        }
    }

    void end(Failure why)
    {
        if (ended_)
            return;
        ended_ = std::move(why);
        heard_.notify();
    }

    Stream stream_;
    asio::steady_timer closing_;
    async::Wakeup heard_;
    std::size_t max_queued_;
    beast::flat_buffer buffer_;
    std::deque<std::string> inbox_;
    std::deque<std::string> queue_; ///< The first is being written.
    std::size_t queued_ = 0;        ///< Bytes of them.
    websocket::close_reason goodbye_;
    std::optional<Failure> ended_;
    std::uint16_t farewell_ = 0;
    bool is_resting_ = false; ///< Enough is unread.
    bool is_closing_ = false;
};

template<class Stream>
class ClientChannel final : public Channel
{
public:
    explicit ClientChannel(std::shared_ptr<Connection<Stream>> connection)
        : connection_(std::move(connection))
    {}
    ~ClientChannel() override { connection_->drop(); }

    result<> send(std::string text) override { return connection_->send(std::move(text)); }
    asio::awaitable<result<std::string>> receive() override { return connection_->receive(); }
    void close(std::uint16_t code, std::string reason) override
    {
        connection_->close(code, std::move(reason));
    }
    std::size_t queued() noexcept override { return connection_->queued(); }
    std::uint16_t farewell() const noexcept override { return connection_->farewell(); }

private:
    std::shared_ptr<Connection<Stream>> connection_;
};

Failure explain(beast::error_code error, std::string_view step)
{
    if (error == asio::error::operation_aborted)
        return Failure(error);
    return Failure(errc::unreachable,
                   error == beast::error::timeout ? concat("no ", step, " in time") : error.message());
}

class BeastWebSocketClient final : public WebSocketClient
{
public:
    BeastWebSocketClient(asio::any_io_executor executor, std::filesystem::path authorities, Logger log)
        : executor_(std::move(executor)), trust_(std::move(authorities), std::move(log)), resolver_(executor_)
    {}

    asio::awaitable<result<std::unique_ptr<Channel>>> connect(WebSocketRequest request) override;

private:
    asio::any_io_executor executor_;
    adapters::TlsTrust trust_;
    adapters::NameResolver resolver_;
};

asio::awaitable<result<>> connect_tcp(beast::tcp_stream& stream, std::vector<tcp::endpoint> addresses)
{
    auto const [error, endpoint] =
        co_await stream.async_connect(addresses, asio::as_tuple(asio::use_awaitable));
    if (error)
        co_return explain(error, "connection");
    beast::error_code ignored;
    stream.socket().set_option(tcp::no_delay(true), ignored);
    co_return result<>();
}

asio::awaitable<result<>> encrypt(beast::ssl_stream<beast::tcp_stream>& stream, std::string host)
{
    if (!adapters::expect_host(stream.native_handle(), host))
        co_return Failure(errc::unavailable, "there is no memory for TLS");
    auto const [error] =
        co_await stream.async_handshake(asio::ssl::stream_base::client, asio::as_tuple(asio::use_awaitable));
    if (!error)
        co_return result<>();
    if (error == beast::error::timeout || error == asio::error::operation_aborted)
        co_return explain(error, "answer by TLS");
    bool const is_of_openssl = error.category() == asio::error::get_ssl_category();
    auto const openssl_error = is_of_openssl ? static_cast<unsigned long>(error.value()) : 0UL;
    co_return Failure(errc::unreachable,
                      adapters::handshake_problem(stream.native_handle(), openssl_error, error.message()));
}

/// The deadline is that of the stream below.
template<class Stream>
asio::awaitable<result<>> shake_hands(Stream& stream, Target const& target, HttpHeaders headers)
{
    std::string host;
    append_authority(host, target);
    std::erase_if(headers, [&host](auto const& header) {
        bool const is_host = equal_ignoring_case(header.first, "Host");
        if (is_host)
            host = header.second;
        return is_host;
    });
    stream.set_option(websocket::stream_base::decorator([&headers](websocket::request_type& request) {
        request.set(http::field::user_agent, "webots_cloud");
        for (auto const& [name, value] : headers)
            request.set(name, value);
    }));
    websocket::response_type answer;
    auto const [error] =
        co_await stream.async_handshake(answer, host, target.path, asio::as_tuple(asio::use_awaitable));
    if (!error)
        co_return result<>();
    if (error == beast::error::timeout)
        co_return Failure(errc::timed_out, "no answer to the WebSocket handshake in time");
    if (error == asio::error::operation_aborted)
        co_return Failure(error);
    if (error == websocket::error::upgrade_declined)
        co_return Failure(errc::protocol_error, concat("answered HTTP ", std::to_string(answer.result_int()),
                                                       " instead of a WebSocket"));
    co_return Failure(errc::protocol_error, concat("no WebSocket: ", error.message()));
}

asio::awaitable<result<std::unique_ptr<Channel>>> BeastWebSocketClient::connect(WebSocketRequest request)
{
    auto const deadline = std::chrono::steady_clock::now() + request.timeout;
    auto const target = adapters::parse_target(request.url, adapters::UrlScheme::websocket);
    if (!target)
        co_return target.error();
    auto addresses = co_await adapters::endpoints_of(resolver_, *target, deadline);
    if (!addresses)
        co_return addresses.error();
    if (!target->tls) {
        auto const connection = std::make_shared<Connection<PlainStream>>(executor_, request);
        auto& stream = connection->stream();
        stream.next_layer().expires_at(deadline);
        auto const connected = co_await connect_tcp(stream.next_layer(), std::move(*addresses));
        if (!connected)
            co_return connected.error();
        auto const accepted = co_await shake_hands(stream, *target, std::move(request.headers));
        if (!accepted)
            co_return accepted.error();
        connection->start();
        co_return std::make_unique<ClientChannel<PlainStream>>(connection);
    }
    auto const trusted = trust_.context();
    if (!trusted)
        co_return trusted.error();
    SSL_CTX_up_ref(*trusted);
    asio::ssl::context context(*trusted); // the connection has a share of its own
    auto const connection = std::make_shared<Connection<TlsStream>>(executor_, request, context);
    auto& stream = connection->stream();
    auto& tcp_stream = beast::get_lowest_layer(stream);
    tcp_stream.expires_at(deadline);
    auto const connected = co_await connect_tcp(tcp_stream, std::move(*addresses));
    if (!connected)
        co_return connected.error();
    auto const encrypted = co_await encrypt(stream.next_layer(), target->host);
    if (!encrypted)
        co_return encrypted.error();
    auto const accepted = co_await shake_hands(stream, *target, std::move(request.headers));
    if (!accepted)
        co_return accepted.error();
    connection->start();
    co_return std::make_unique<ClientChannel<TlsStream>>(connection);
}

} // namespace

std::unique_ptr<WebSocketClient> make_websocket_client(asio::any_io_executor executor,
                                                       std::filesystem::path authorities, Logger log)
{
    return std::make_unique<BeastWebSocketClient>(std::move(executor), std::move(authorities),
                                                  std::move(log));
}

} // namespace webots_cloud
