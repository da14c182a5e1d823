// Reads, writes and handshakes on a non-blocking socket, with OpenSSL directly on it. A handshake goes on one
// step at a time, in turns with others (handshakes.hpp), since it is the most expensive thing that a stranger
// can ask for.
#include "network_stream.hpp"

#include "adapters/tls/tls_socket.hpp"

#include <boost/asio/deferred.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/post.hpp>

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using Error = NetworkStream::Error;

namespace {

constexpr auto as_result = asio::as_tuple(asio::deferred);

/// From how many bytes on there is something to read.
using ReceiveLowWatermark = asio::socket_base::receive_low_watermark;

Error last_error()
{
    bool const is_blocked = errno == EAGAIN || errno == EWOULDBLOCK;
    return is_blocked ? Error(asio::error::would_block) : Error(errno, boost::system::system_category());
}

} // namespace

void TlsConnectionDeleter::operator()(SSL* tls) const noexcept
{
    SSL_free(tls);
}

NetworkStream::NetworkStream(asio::ip::tcp::socket socket, SSL_CTX* tls) : socket_(std::move(socket))
{
    Error ignored;
    socket_.native_non_blocking(true, ignored);
    socket_.set_option(asio::ip::tcp::no_delay(true), ignored);
    if (tls && SSL_CTX_up_ref(tls) == 1)
        context_.reset(tls);
    else if (tls) // it must not be spoken with in plain text
        socket_.close(ignored);
}

void NetworkStream::encrypt(TlsConnection tls) noexcept
{
    tls_ = std::move(tls);
    attach_tls(tls_.get(), socket_.native_handle());
}

/// One step of the handshake; `would_block`: the next one `needs` the peer.
Error NetworkStream::shake(Direction& needs)
{
    if (!socket_.is_open()) // closed meanwhile, and its descriptor may be another connection's
        return asio::error::operation_aborted;
    ERR_clear_error();
    int const outcome = SSL_do_handshake(tls_.get());
    if (outcome == 1)
        return {};
    auto const error = failure(outcome, needs);
    if (error != asio::error::would_block)
        handshake_error_ = ERR_peek_error();
    return error;
}

asio::awaitable<Error> NetworkStream::handshake()
{
    for (;;) {
        auto needs = Direction::wait_read;
        auto const outcome = shake(needs);
        if (outcome != asio::error::would_block)
            co_return outcome;
        auto const [error] = co_await socket_.async_wait(needs, as_result);
        if (error)
            co_return error;
    }
}

asio::awaitable<Error> NetworkStream::answer_handshake(Handshakes& handshakes, std::string const& client)
{
    auto const silent = co_await await_hello();
    if (silent)
        co_return silent;
    for (;;) {
        co_await handshakes.turn(client);
        auto needs = Direction::wait_read;
        auto const outcome = begin_tls(handshakes) ? shake(needs) : Error(asio::error::no_memory);
        if (outcome != asio::error::would_block)
            co_return outcome;
        auto const [error] = co_await socket_.async_wait(needs, as_result);
        if (error)
            co_return error;
    }
}

/// At the first step, and no sooner: false when there is no memory.
bool NetworkStream::begin_tls(Handshakes& handshakes)
{
    if (tls_)
        return true;
    TlsConnection tls(handshakes.has_memory() ? SSL_new(context_.get()) : nullptr);
    context_.reset();
    if (!tls)
        return false;
    SSL_set_accept_state(tls.get());
    encrypt(std::move(tls));
    return true;
}

/// Until the first record of the client is there as a whole, or something that is none: what that is, OpenSSL
/// says.
asio::awaitable<Error> NetworkStream::await_hello()
{
    // RFC 8446, 5.1: type, version, length; no record of a handshake is longer.
    constexpr unsigned char handshake_record = 22;
    constexpr int max_record = 16 * 1024;
    std::array<unsigned char, 5> head{};
    int needed = static_cast<int>(head.size());
    Error ignored;
    for (bool is_length_known = false;;) {
        socket_.set_option(ReceiveLowWatermark(needed), ignored);
        auto const [error] = co_await socket_.async_wait(Direction::wait_read, as_result);
        if (error)
            co_return error;
        auto const size = ::recv(socket_.native_handle(), head.data(), head.size(), MSG_PEEK | MSG_DONTWAIT);
        if (size < 0 && last_error() == asio::error::would_block)
            continue; // Asio may take what happened to an earlier socket for this one's
        if (size <= 0)
            co_return size == 0 ? Error(asio::error::eof) : last_error();
        if (is_length_known || size < needed || head[0] != handshake_record)
            break;
        needed += std::min(head[3] << 8 | head[4], max_record);
        is_length_known = true;
    }
    socket_.set_option(ReceiveLowWatermark(1), ignored);
    co_return Error();
}

bool NetworkStream::turn_plain() noexcept
{
    bool const met_plain_http = ERR_GET_REASON(handshake_error_) == SSL_R_HTTP_REQUEST;
    if (met_plain_http)
        tls_.reset();
    return met_plain_http;
}

asio::awaitable<std::pair<Error, std::size_t>> NetworkStream::read_some(asio::mutable_buffer buffer)
{
    if (tls_)
        co_return co_await read_tls(buffer);
    auto const [error, size] = co_await read_plain(buffer);
    co_return std::pair(error, size);
}

asio::awaitable<std::pair<Error, std::size_t>> NetworkStream::read_tls(asio::mutable_buffer buffer)
{
    std::pair<Error, std::size_t> outcome;
    for (;;) {
        outcome.second = try_read(buffer, outcome.first);
        if (outcome.first != asio::error::would_block)
            break;
        auto const [error] = co_await wait_to_read(as_result);
        outcome.first = error;
        if (error)
            co_return outcome;
    }
    // A peer that always has something to say must not keep the others waiting.
    co_await asio::post(asio::deferred);
    co_return outcome;
}

asio::awaitable<Error> NetworkStream::write(std::string_view bytes)
{
    while (!bytes.empty()) {
        Error error;
        bytes.remove_prefix(try_write(bytes, error));
        if (error == asio::error::would_block) {
            auto const [waited] = co_await wait_to_write(as_result);
            error = waited;
        }
        if (error)
            co_return error;
    }
    co_return Error();
}

/// Why OpenSSL did not do what it was asked to, and what it waits for.
Error NetworkStream::failure(int outcome, Direction& needs)
{
    auto const os_error = errno;
    switch (SSL_get_error(tls_.get(), outcome)) {
    case SSL_ERROR_WANT_READ:
        needs = Direction::wait_read;
        return asio::error::would_block;
    case SSL_ERROR_WANT_WRITE:
        needs = Direction::wait_write;
        return asio::error::would_block;
    case SSL_ERROR_ZERO_RETURN:
        return asio::error::eof;
    case SSL_ERROR_SYSCALL:
        return os_error != 0 ? Error(os_error, boost::system::system_category()) : Error(asio::error::eof);
    default:
        return asio::error::connection_aborted; // the peer does not speak TLS, or not ours
    }
}

template<class TlsCall, class PlainCall>
std::size_t NetworkStream::transfer(TlsCall const& tls_call, PlainCall const& plain_call, Direction& needs,
                                    Error& error)
{
    error = {};
    if (!socket_.is_open()) {
        error = asio::error::operation_aborted;
        return 0;
    }
    if (tls_) {
        ERR_clear_error();
        int const size = tls_call(tls_.get());
        if (size <= 0)
            error = failure(size, needs);
        return size > 0 ? static_cast<std::size_t>(size) : 0;
    }
    auto const size = plain_call(socket_.native_handle());
    if (size < 0)
        error = last_error();
    return size > 0 ? static_cast<std::size_t>(size) : 0;
}

std::size_t NetworkStream::try_read(asio::mutable_buffer buffer, Error& error)
{
    auto const size = transfer([&](SSL* tls) { return SSL_read(tls, buffer.data(), clamped(buffer.size())); },
                               [&](int socket) { return ::recv(socket, buffer.data(), buffer.size(), 0); },
                               read_needs_, error);
    if (size == 0 && !error)
        error = asio::error::eof;
    return size;
}

std::size_t NetworkStream::try_write(std::string_view bytes, Error& error)
{
    return transfer([&](SSL* tls) { return SSL_write(tls, bytes.data(), clamped(bytes.size())); },
                    [&](int socket) { return ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL); },
                    write_needs_, error);
}

std::size_t NetworkStream::unsent() noexcept
{
    int bytes = 0;
    bool const is_known = ::ioctl(socket_.native_handle(), SIOCOUTQNSD, &bytes) == 0 && bytes > 0;
    return is_known ? static_cast<std::size_t>(bytes) : 0;
}

NetworkStream::Released NetworkStream::release() noexcept
{
    Released released;
    Error error;
    if (socket_.is_open())
        released.descriptor = socket_.release(error);
    if (error)
        released.descriptor = -1;
    released.tls = std::move(tls_);
    return released;
}

void NetworkStream::restore(Released released) noexcept
{
    Error error;
    socket_.assign(asio::ip::tcp::v6(), released.descriptor, error);
    if (error)
        ::close(released.descriptor); // no memory to watch it with
    else
        socket_.native_non_blocking(true, error);
    tls_ = std::move(released.tls);
}

void NetworkStream::shut_down() noexcept
{
    Error ignored;
    say_end();
    socket_.shutdown(asio::ip::tcp::socket::shutdown_send, ignored);
}

void NetworkStream::say_end() noexcept
{
    if (tls_ && socket_.is_open())
        adapters::say_end(tls_.get());
}

void NetworkStream::close() noexcept
{
    Error ignored;
    socket_.close(ignored);
}

} // namespace webots_cloud::adapters
