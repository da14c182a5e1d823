// Moves the bytes of one connection, plain or encrypted, without ever waiting: Tunnels waits for all of
// them together.
#include "tunnel_end.hpp"

#include "adapters/tls/tls_socket.hpp"

#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <cerrno>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

bool is_blocked(int error) noexcept
{
    return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

} // namespace

void TunnelEnd::notice(std::uint32_t events) noexcept
{
    // TLS may have to write in order to read, and the other way round.
    bool const is_either = is_tls() && (events & (EPOLLIN | EPOLLOUT)) != 0;
    may_read_ = may_read_ || is_either || (events & (EPOLLIN | EPOLLRDHUP | EPOLLHUP | EPOLLERR)) != 0;
    may_write_ = may_write_ || is_either || (events & (EPOLLOUT | EPOLLHUP | EPOLLERR)) != 0;
    has_hung_up_ = has_hung_up_ || (events & (EPOLLRDHUP | EPOLLHUP | EPOLLERR)) != 0;
    is_broken_ = is_broken_ || (events & EPOLLERR) != 0;
}

TunnelEnd::Reading TunnelEnd::read(char* to, std::size_t size, bool peek, std::size_t& read) noexcept
{
    read = 0;
    if (is_tls())
        return read_tls(to, size, read);
    auto const got = ::recv(connection_.descriptor, to, size, peek ? MSG_PEEK : 0);
    if (got > 0) {
        read = static_cast<std::size_t>(got);
        // Less than there was room for: that was all, and the kernel will tell of more. Not of the end, of
        // which it has told already.
        may_read_ = has_hung_up_ || read == size || peek;
        return Reading::some;
    }
    if (got < 0 && is_blocked(errno)) {
        may_read_ = errno == EINTR;
        return Reading::nothing;
    }
    has_hung_up_ = true;
    is_broken_ = is_broken_ || got < 0;
    return Reading::over;
}

void TunnelEnd::discard(char* scratch, std::size_t size, bool is_all) noexcept
{
    may_read_ = has_hung_up_ || !is_all;
    while (size > 0) {
        auto const gone = ::recv(connection_.descriptor, scratch, size, MSG_TRUNC); // without a copy
        if (gone <= 0)
            return;
        size -= std::min(size, static_cast<std::size_t>(gone));
    }
}

TunnelEnd::Reading TunnelEnd::read_tls(char* to, std::size_t size, std::size_t& read) noexcept
{
    // One call gives one record, of 16 KiB at most.
    while (read < size) {
        ERR_clear_error();
        int const got = SSL_read(connection_.tls.get(), to + read, clamped(size - read));
        if (got > 0) {
            read += static_cast<std::size_t>(got);
            continue;
        }
        int const error = SSL_get_error(connection_.tls.get(), got);
        if (error == SSL_ERROR_WANT_READ || error == SSL_ERROR_WANT_WRITE) {
            may_read_ = false;
            return read > 0 ? Reading::some : Reading::nothing;
        }
        if (read > 0)
            return Reading::some; // the end is found again
        has_hung_up_ = true;
        is_broken_ = is_broken_ || error != SSL_ERROR_ZERO_RETURN;
        return Reading::over;
    }
    return Reading::some;
}

std::size_t TunnelEnd::write(std::string_view bytes) noexcept
{
    if (is_tls())
        return write_tls(bytes);
    auto const sent = ::send(connection_.descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && !is_blocked(errno))
        is_broken_ = true;
    auto const size = sent > 0 ? static_cast<std::size_t>(sent) : 0;
    may_write_ = size == bytes.size() || (sent < 0 && errno == EINTR);
    return size;
}

std::size_t TunnelEnd::write_tls(std::string_view bytes) noexcept
{
    std::size_t written = 0;
    auto* const tls = connection_.tls.get();
    while (written < bytes.size()) {
        ERR_clear_error();
        // A packet has room for several records, and each packet wakes the peer.
        announce_more(tls, bytes.size() - written > SSL3_RT_MAX_PLAIN_LENGTH);
        int const sent = SSL_write(tls, bytes.data() + written, clamped(bytes.size() - written));
        if (sent > 0) {
            written += static_cast<std::size_t>(sent);
            continue;
        }
        int const error = SSL_get_error(tls, sent);
        may_write_ = false;
        is_broken_ = is_broken_ || (error != SSL_ERROR_WANT_READ && error != SSL_ERROR_WANT_WRITE);
        break;
    }
    announce_more(tls, false);
    return written;
}

void TunnelEnd::shut_down() noexcept
{
    if (is_shut_down_ || connection_.descriptor < 0)
        return;
    is_shut_down_ = true;
    if (is_tls() && !is_broken_)
        say_end(connection_.tls.get());
    ::shutdown(connection_.descriptor, SHUT_WR);
}

void TunnelEnd::close() noexcept
{
    connection_.tls.reset();
    if (connection_.descriptor >= 0)
        ::close(connection_.descriptor);
    connection_.descriptor = -1;
}

NetworkStream::Released TunnelEnd::release() noexcept
{
    NetworkStream::Released released;
    std::swap(released, connection_);
    return released;
}

} // namespace webots_cloud::adapters
