// A connection to the server that a request is passed on to.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>

#include <cstddef>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

/// Connects, over TCP or through a broker, and exchanges the first bytes.
///
/// Without deadlines of its own: `close` ends what waits.   Thread-safety: one executor.
class UpstreamSocket
{
public:
    explicit UpstreamSocket(boost::asio::any_io_executor const& executor);

    /// `upstream` must outlive it.
    ///
    /// Errors: `unreachable`, with the reason for the log; `unavailable`: no descriptor is left.
    boost::asio::awaitable<result<>> connect(Upstream const& upstream);

    boost::asio::awaitable<boost::system::error_code> write(std::string_view bytes);

    /// At least one byte, as soon as there is one.
    boost::asio::awaitable<std::pair<boost::system::error_code, std::size_t>> read_some(char* to,
                                                                                        std::size_t size);

    void close() noexcept;

    /// The descriptor, without which this is closed; negative when it is closed already.
    int release() noexcept;

private:
    boost::asio::awaitable<result<>> connect_through(std::string broker);
    result<> take_socket();

    boost::asio::ip::tcp::socket socket_;
    boost::asio::local::stream_protocol::socket broker_;
    boost::asio::steady_timer retry_;
    bool is_closed_ = false;
};

} // namespace webots_cloud::adapters
