// The listening socket of a server, and what to do when descriptors, or watches of epoll, run out.
#pragma once

#include "watch_reserve.hpp"

#include <webots_cloud/error.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <cstddef>
#include <cstdint>
#include <string>

namespace webots_cloud::adapters {

class Acceptor
{
public:
    explicit Acceptor(boost::asio::any_io_executor const& executor) : acceptor_(executor) {}
    ~Acceptor() { close(); }

    /// Errors: `invalid_argument` when `address` is not numeric; `unavailable`, naming the port.
    result<> listen(std::string const& address, std::uint16_t port);

    /// Until a connection waits to be taken, as (error).
    auto wait()
    {
        return acceptor_.async_wait(boost::asio::ip::tcp::acceptor::wait_read,
                                    boost::asio::as_tuple(boost::asio::deferred));
    }

    /// Accepts the connection that has waited longest.
    /// Errors: `would_block`: none waits; `no_space_on_device`: it is lost, since the event loop can't watch
    /// it; all others leave it waiting.
    boost::system::error_code take(boost::asio::ip::tcp::socket& socket);

    /// Keeps watches in reserve for connections.
    void keep_watches() { watches_.fill(); }

    /// To be called now and then.
    void renew_watches() { watches_.refill(); }

    /// Closes the connection that has waited longest, without an answer, when no descriptor is left for it:
    /// better than to let it wait in vain. False when that failed too.
    bool turn_away();

    void close();

    bool is_open() const { return acceptor_.is_open(); }
    std::uint16_t port() const { return acceptor_.local_endpoint().port(); }

private:
    result<> open(boost::asio::ip::tcp::endpoint const& where);

    boost::asio::ip::tcp::acceptor acceptor_;
    boost::asio::ip::tcp protocol_ = boost::asio::ip::tcp::v6();
    WatchReserve watches_;
    int reserve_ = -1; ///< A descriptor to let go of when there is no other.
};

/// How many connections there may be when `spare` descriptors, but at most half of all, are kept for
/// everything else.
std::size_t affordable_connections(std::size_t spare);

} // namespace webots_cloud::adapters
