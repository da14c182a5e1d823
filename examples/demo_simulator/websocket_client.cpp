#include "websocket_client.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>

#include <deque>
#include <optional>

namespace webots_cloud::demo {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::system::error_code;

constexpr std::size_t max_message_size = std::size_t{1} << 20;
constexpr std::size_t max_queued_state_frames = 4;
constexpr std::size_t max_queued_frames = 1000;
constexpr std::size_t max_queued_bytes = std::size_t{16} << 20;

class WebSocketClient : public ClientOutlet, public std::enable_shared_from_this<WebSocketClient>
{
public:
    WebSocketClient(asio::ip::tcp::socket socket, http::request<http::empty_body> upgrade,
                    Reception& reception, Seat seat)
        : socket_(std::move(socket)), upgrade_(std::move(upgrade)), reception_(reception),
          seat_(std::move(seat))
    {}

    void accept()
    {
        websocket::stream_base::timeout timeout{};
        timeout.handshake_timeout = std::chrono::seconds(10);
        timeout.idle_timeout = websocket::stream_base::none();
        socket_.set_option(timeout);
        socket_.read_message_max(max_message_size);
        socket_.auto_fragment(false);
        socket_.text(true);
        error_code ignored;
        socket_.next_layer().set_option(asio::ip::tcp::no_delay(true), ignored);
        socket_.async_accept(upgrade_, [self = shared_from_this()](error_code error) {
            if (!error)
                self->open();
        });
    }

    void send(Text text, bool is_state) override
    {
        if (!id_ || (is_state && queue_.size() >= max_queued_state_frames))
            return;
        queued_bytes_ += text->size();
        queue_.push_back(std::move(text));
        error_code ignored;
        if (queue_.size() > max_queued_frames || queued_bytes_ > max_queued_bytes)
            socket_.next_layer().close(ignored); // the pending operations end with an error
        else if (queue_.size() == 1)
            write_next();
    }

private:
    void open()
    {
        id_ = reception_.open_client(weak_from_this());
        read_next();
    }

    void read_next()
    {
        socket_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
            if (error)
                return self->close();
            std::string_view const text(static_cast<char const*>(self->buffer_.data().data()),
                                        self->buffer_.size());
            self->reception_.receive(*self->id_, self->socket_.got_text() ? text : "(binary frame)");
            self->buffer_.consume(self->buffer_.size());
            self->read_next();
        });
    }

    void write_next()
    {
        socket_.async_write(asio::buffer(*queue_.front()),
                            [self = shared_from_this()](error_code error, std::size_t) {
                                if (error)
                                    return; // the read ends too, and closes
                                self->queued_bytes_ -= self->queue_.front()->size();
                                self->queue_.pop_front();
                                if (!self->queue_.empty())
                                    self->write_next();
                            });
    }

    void close() { reception_.close_client(*id_); }

    /// Without compression, which browsers of pictures do not get, and without the deadlines of a Beast
    /// stream: the compiler would write both for each of its operations.
    websocket::stream<asio::ip::tcp::socket, false> socket_;
    http::request<http::empty_body> upgrade_;
    beast::flat_buffer buffer_;
    Reception& reception_;
    Seat seat_;
    std::optional<ClientId> id_; ///< once the handshake is done
    std::deque<Text> queue_;
    std::size_t queued_bytes_ = 0;
};

} // namespace

void serve_websocket(beast::tcp_stream stream, http::request<http::empty_body> upgrade, Reception& reception,
                     Seat seat)
{
    std::make_shared<WebSocketClient>(stream.release_socket(), std::move(upgrade), reception, std::move(seat))
        ->accept();
}

} // namespace webots_cloud::demo
