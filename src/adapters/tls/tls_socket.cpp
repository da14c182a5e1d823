#include "tls_socket.hpp"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdint>
#include <sys/socket.h>
#include <sys/types.h>

namespace webots_cloud::adapters {
namespace {

// The data of a BIO is one word: the descriptor, and in the lowest bit whether more follows.
std::intptr_t word_of(BIO* bio)
{
    return reinterpret_cast<std::intptr_t>(BIO_get_data(bio));
}

void set_word(BIO* bio, std::intptr_t descriptor, bool more)
{
    BIO_set_data(bio, reinterpret_cast<void*>(descriptor * 2 + (more ? 1 : 0)));
}

int descriptor_of(BIO* bio)
{
    return static_cast<int>(word_of(bio) / 2);
}

bool has_more(BIO* bio)
{
    return word_of(bio) % 2 != 0;
}

bool is_passing(ssize_t outcome)
{
    return outcome < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
}

int read_socket(BIO* bio, char* data, int size)
{
    BIO_clear_retry_flags(bio);
    auto const outcome = ::recv(descriptor_of(bio), data, static_cast<std::size_t>(size), 0);
    if (is_passing(outcome))
        BIO_set_retry_read(bio);
    if (outcome == 0)
        errno = 0; // the end is no error
    return static_cast<int>(outcome);
}

int write_socket(BIO* bio, char const* data, int size)
{
    BIO_clear_retry_flags(bio);
    int const flags = has_more(bio) ? MSG_NOSIGNAL | MSG_MORE : MSG_NOSIGNAL;
    auto const outcome = ::send(descriptor_of(bio), data, static_cast<std::size_t>(size), flags);
    if (is_passing(outcome))
        BIO_set_retry_write(bio);
    return static_cast<int>(outcome);
}

long control_socket(BIO*, int command, long, void*)
{
    return command == BIO_CTRL_FLUSH ? 1 : 0;
}

BIO_METHOD* socket_method()
{
    static BIO_METHOD* const method = [] {
        auto* const made = BIO_meth_new(BIO_get_new_index() | BIO_TYPE_SOURCE_SINK, "socket without SIGPIPE");
        BIO_meth_set_read(made, read_socket);
        BIO_meth_set_write(made, write_socket);
        BIO_meth_set_ctrl(made, control_socket);
        return made;
    }();
    return method;
}

} // namespace

void attach_tls(SSL* tls, int descriptor)
{
    auto* const bio = BIO_new(socket_method());
    set_word(bio, descriptor, false);
    BIO_set_init(bio, 1);
    SSL_set_bio(tls, bio, bio);
}

void announce_more(SSL* tls, bool more)
{
    auto* const bio = SSL_get_wbio(tls);
    set_word(bio, descriptor_of(bio), more);
}

void say_end(SSL* tls) noexcept
{
    if (SSL_is_init_finished(tls) == 0)
        return;
    ERR_clear_error();
    SSL_shutdown(tls);
}

int clamped(std::size_t size) noexcept
{
    return static_cast<int>(std::min<std::size_t>(size, INT_MAX));
}

} // namespace webots_cloud::adapters
