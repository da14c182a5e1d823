#include "connection.hpp"

#include "extern_controllers.hpp"
#include "websocket_client.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include <chrono>
#include <optional>

namespace webots_cloud::demo {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;

constexpr std::chrono::seconds first_request_time{10};
constexpr std::chrono::seconds next_request_time{60};
constexpr std::size_t max_header_size = 16 * 1024;
constexpr std::string_view controller_greeting = "CTR";

/// A peer that has not yet become a WebSocket or a picture stream: HTTP, or an extern controller.
class Connection : public std::enable_shared_from_this<Connection>
{
public:
    Connection(asio::ip::tcp::socket socket, Reception& reception, Seat seat)
        : stream_(std::move(socket)), buffer_(2 * max_header_size), reception_(reception),
          seat_(std::move(seat))
    {}

    void read_first_bytes()
    {
        stream_.expires_after(first_request_time);
        stream_.async_read_some(buffer_.prepare(1024),
                                [self = shared_from_this()](error_code error, std::size_t size) {
                                    if (error)
                                        return;
                                    self->buffer_.commit(size);
                                    self->choose_protocol();
                                });
    }

private:
    std::string_view received() const
    {
        return {static_cast<char const*>(buffer_.data().data()), buffer_.size()};
    }

    void choose_protocol()
    {
        std::string_view const start = received().substr(0, controller_greeting.size());
        if (start == controller_greeting)
            answer_controller();
        else if (controller_greeting.starts_with(start))
            read_first_bytes();
        else
            read_request();
    }

    void answer_controller()
    {
        auto controller = reception_.answer_controller(received());
        if (!controller.robot.empty()) {
            stream_.expires_never();
            return serve_controller(stream_.release_socket(), std::move(controller), reception_,
                                    std::move(seat_));
        }
        answer_ = std::move(controller.text);
        asio::async_write(stream_, asio::buffer(answer_),
                          [self = shared_from_this()](error_code, std::size_t) {});
    }

    void read_request()
    {
        parser_.emplace();
        parser_->header_limit(max_header_size);
        http::async_read(stream_, buffer_, *parser_,
                         [self = shared_from_this()](error_code error, std::size_t) {
                             if (!error)
                                 self->serve_request();
                         });
    }

    void serve_request()
    {
        auto request = parser_->release();
        if (beast::websocket::is_upgrade(request)) {
            stream_.expires_never();
            return serve_websocket(std::move(stream_), std::move(request), reception_, std::move(seat_));
        }
        std::string const target(request.target());
        if (target.substr(0, target.find('?')) == "/mjpeg" && reception_.streams_pictures()) {
            stream_.expires_never();
            return serve_pictures(stream_.release_socket(), reception_, std::move(seat_));
        }
        bool const is_get = request.method() == http::verb::get;
        FileRequest file;
        file.target = is_get ? target : "";
        file.host = std::string(request[http::field::host]);
        file.if_none_match = std::string(request[http::field::if_none_match]);
        answer(reception_.answer_file(file), is_get && request.keep_alive());
    }

    void answer(std::string text, bool keep_alive)
    {
        answer_ = std::move(text);
        stream_.expires_after(next_request_time);
        asio::async_write(stream_, asio::buffer(answer_),
                          [self = shared_from_this(), keep_alive](error_code error, std::size_t) {
                              if (!error && keep_alive)
                                  self->read_request();
                          });
    }

    beast::tcp_stream stream_;
    beast::flat_buffer buffer_;
    std::optional<http::request_parser<http::empty_body>> parser_;
    std::string answer_;
    Reception& reception_;
    Seat seat_;
};

} // namespace

void serve(asio::ip::tcp::socket socket, Reception& reception, Seat seat)
{
    std::make_shared<Connection>(std::move(socket), reception, std::move(seat))->read_first_bytes();
}

} // namespace webots_cloud::demo
