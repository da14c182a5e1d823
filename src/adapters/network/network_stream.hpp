// A connection of the server, plain or TLS.
#pragma once

#include "adapters/tls/tls_certificate.hpp"
#include "handshakes.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <cstddef>
#include <memory>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

struct TlsConnectionDeleter
{
    void operator()(SSL* tls) const noexcept;
};

using TlsConnection = std::unique_ptr<SSL, TlsConnectionDeleter>;

/// Non-blocking reads and writes, and waits for readiness.
///
/// One class for both kinds, and OpenSSL on the socket itself: an idle connection holds no buffers and no
/// operation of its own, where a stream of Asio's would keep 34 KB, and both kinds share the code above.
/// Thread-safety: one executor.
class NetworkStream
{
public:
    using Error = boost::system::error_code;

    /// A connection that the event loop does not watch.
    struct Released
    {
        int descriptor = -1; ///< Negative: none.
        TlsConnection tls;
    };

    /// Plain without `tls`; with it, `answer_handshake` must come first.
    NetworkStream(boost::asio::ip::tcp::socket socket, SSL_CTX* tls);

    /// Speaks TLS from here on, as `tls` says; `handshake` must come first.
    void encrypt(TlsConnection tls) noexcept;

    /// The TLS handshake. Without a deadline of its own: the caller closes the stream.
    boost::asio::awaitable<Error> handshake();

    /// The same on the side of the server, in the turns of `client`. TLS takes memory only when the client
    /// has said all that it begins with.   Lifetime: the arguments must outlive the operation.
    boost::asio::awaitable<Error> answer_handshake(Handshakes& handshakes, std::string const& client);

    /// After a handshake that failed: true when the peer sent an HTTP request instead. Then the stream is
    /// plain from here on, so that the peer can be sent an error.
    bool turn_plain() noexcept;

    /// At least one byte, as soon as there is one.
    boost::asio::awaitable<std::pair<Error, std::size_t>> read_some(boost::asio::mutable_buffer buffer);

    /// The same for a stream without TLS, and without a frame of its own: a tuple of an error and a size.
    auto read_plain(boost::asio::mutable_buffer buffer)
    {
        return socket_.async_read_some(buffer, boost::asio::as_tuple(boost::asio::deferred));
    }

    /// All of `bytes`.
    boost::asio::awaitable<Error> write(std::string_view bytes);

    // At once; `error` is `would_block` when nothing can be done now.
    std::size_t try_read(boost::asio::mutable_buffer buffer, Error& error);
    std::size_t try_write(std::string_view bytes, Error& error);

    /// What was written, and the kernel has not sent yet: on a slow network it takes megabytes, seconds of
    /// pictures, before it lets a write wait.
    std::size_t unsent() noexcept;

    /// Calls `handler(error_code)` when a read, or write, that would have blocked may go on.
    template<class Token>
    auto wait_to_read(Token&& token)
    {
        return socket_.async_wait(read_needs_, std::forward<Token>(token));
    }
    template<class Token>
    auto wait_to_write(Token&& token)
    {
        return socket_.async_wait(write_needs_, std::forward<Token>(token));
    }

    /// Hands the connection over, for somebody else to watch and to close. This is closed then.
    Released release() noexcept;

    /// Takes it back.
    void restore(Released released) noexcept;

    /// Tells the peer that nothing more will be written.
    void shut_down() noexcept;

    /// The same where it speaks TLS, before `close`: a plain connection tells that by itself.
    void say_end() noexcept;

    /// Ends everything that waits.
    void close() noexcept;

    bool is_tls() const noexcept { return tls_ != nullptr || context_ != nullptr; }
    SSL* tls() const noexcept { return tls_.get(); }

    /// After a handshake that failed: what OpenSSL said of it; 0: nothing.
    unsigned long handshake_error() const noexcept { return handshake_error_; }
    boost::asio::ip::tcp::socket& socket() noexcept { return socket_; }

private:
    using Direction = boost::asio::ip::tcp::socket::wait_type;

    boost::asio::awaitable<Error> await_hello();
    bool begin_tls(Handshakes& handshakes);
    Error shake(Direction& needs);
    boost::asio::awaitable<std::pair<Error, std::size_t>> read_tls(boost::asio::mutable_buffer buffer);
    template<class TlsCall, class PlainCall>
    std::size_t transfer(TlsCall const& tls_call, PlainCall const& plain_call, Direction& needs,
                         Error& error);
    Error failure(int outcome, Direction& needs);

    boost::asio::ip::tcp::socket socket_;
    TlsContext context_; ///< Of a handshake that has not begun; else null.
    TlsConnection tls_;
    unsigned long handshake_error_ = 0; ///< The first that OpenSSL noted.
    // TLS may have to write in order to read, and the other way round.
    Direction read_needs_ = Direction::wait_read;
    Direction write_needs_ = Direction::wait_write;
};

} // namespace webots_cloud::adapters
