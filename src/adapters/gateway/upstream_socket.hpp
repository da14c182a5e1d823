// A connection to the server that a request is passed on to.
#pragma once

#include "adapters/network/network_stream.hpp"
#include "upstreams.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>

#include <cstddef>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

/// Connects, over TCP, TLS or through a broker, and exchanges the first bytes.
///
/// Without deadlines of its own: `close` ends what waits.   Thread-safety: one executor.
class UpstreamSocket
{
public:
    /// `upstreams` must outlive it.
    UpstreamSocket(boost::asio::any_io_executor const& executor, Upstreams& upstreams);

    /// `upstream` must outlive it.
    ///
    /// Errors: `unreachable`, with the reason for the log; `unavailable`: no descriptor or no memory is left;
    /// `invalid_config`: whom to trust can't be read.
    boost::asio::awaitable<result<>> connect(Upstream const& upstream);

    /// Takes a connection that there is already.
    void adopt(NetworkStream::Released connection) noexcept { stream_.restore(std::move(connection)); }

    boost::asio::awaitable<boost::system::error_code> write(std::string_view bytes);

    /// At least one byte, as soon as there is one.
    boost::asio::awaitable<std::pair<boost::system::error_code, std::size_t>> read_some(char* to,
                                                                                        std::size_t size);

    void close() noexcept;

    /// The connection, without which this is closed; of no descriptor when it is closed already.
    NetworkStream::Released release() noexcept { return stream_.release(); }

private:
    boost::asio::awaitable<result<>> connect_directly(Upstream const& upstream);
    boost::asio::awaitable<result<Addresses>> resolve(std::string name);
    boost::asio::awaitable<result<>> encrypt(Upstream const& upstream);
    boost::asio::awaitable<result<>> connect_through(std::string broker);
    result<> take_socket();
    Failure unreachable(boost::system::error_code error);

    Upstreams& upstreams_;
    Upstream const* upstream_ = nullptr; ///< Over TLS, until it has answered.
    NetworkStream stream_;
    boost::asio::local::stream_protocol::socket broker_;
    boost::asio::steady_timer retry_;
    boost::asio::cancellation_signal resolving_;
    bool is_closed_ = false;
};

} // namespace webots_cloud::adapters
