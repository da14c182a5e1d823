#include "connection.hpp"

#include <boost/asio/buffer.hpp>
#include <boost/asio/write.hpp>

#include <array>

namespace webots_cloud::demo {
namespace {

namespace asio = boost::asio;
using boost::system::error_code;

constexpr std::string_view header = "HTTP/1.0 200 OK\r\n"
                                    "Server: webots_cloud demo simulator\r\n"
                                    "Connection: close\r\n"
                                    "Access-Control-Allow-Origin: *\r\n"
                                    "Max-Age: 0\r\n"
                                    "Expires: 0\r\n"
                                    "Cache-Control: no-cache, private\r\n"
                                    "Pragma: no-cache\r\n"
                                    "Content-Type: multipart/x-mixed-replace; boundary=WebotsFrame\r\n"
                                    "\r\n";

class PictureStream : public PictureOutlet, public std::enable_shared_from_this<PictureStream>
{
public:
    PictureStream(asio::ip::tcp::socket socket, Reception& reception, Seat seat)
        : socket_(std::move(socket)), reception_(reception), seat_(std::move(seat))
    {}

    void open()
    {
        error_code ignored;
        socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
        write(std::make_shared<std::string const>(header));
        wait_for_end();
        reception_.open_pictures(weak_from_this());
    }

    bool is_ready() const override { return !writing_; }
    void send(Text part) override { write(std::move(part)); }

private:
    void write(Text text)
    {
        writing_ = true;
        auto const bytes = asio::buffer(*text);
        asio::async_write(socket_, bytes, [self = shared_from_this(), text](error_code error, std::size_t) {
            if (error)
                return self->close();
            self->writing_ = false;
            self->reception_.pictures_ready();
        });
    }

    /// Nothing more is expected from the peer: reading only tells that it has gone.
    void wait_for_end()
    {
        socket_.async_read_some(asio::buffer(scrap_),
                                [self = shared_from_this()](error_code error, std::size_t) {
                                    if (error)
                                        return self->close();
                                    self->wait_for_end();
                                });
    }

    void close()
    {
        error_code ignored;
        socket_.close(ignored);
    }

    asio::ip::tcp::socket socket_;
    std::array<char, 512> scrap_{};
    Reception& reception_;
    Seat seat_;
    bool writing_ = false;
};

} // namespace

void serve_pictures(asio::ip::tcp::socket socket, Reception& reception, Seat seat)
{
    std::make_shared<PictureStream>(std::move(socket), reception, std::move(seat))->open();
}

} // namespace webots_cloud::demo
