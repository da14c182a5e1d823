// OpenSSL on a socket, without SIGPIPE.
#pragma once

#include <openssl/types.h>

#include <cstddef>

namespace webots_cloud::adapters {

/// Lets `tls` read and write a socket that does not block. Does not take ownership of `descriptor`.
///
/// With OpenSSL's own BIO, writing to a closed connection ends the program with SIGPIPE: fine in our servers,
/// which ignore that signal, but not in a program that embeds them.
void attach_tls(SSL* tls, int descriptor);

/// Whether other records follow at once those that are written next: then the kernel puts them into the same
/// packets. False must be the last word before anybody waits.
void announce_more(SSL* tls, bool more);

/// Says that nothing more will be written (close_notify), once the handshake is over: whoever hears no such
/// word can't know whether a connection was cut. Not after an error of the connection.
void say_end(SSL* tls) noexcept;

/// A number of bytes as SSL_read and SSL_write take it: no more than an int can say.
int clamped(std::size_t size) noexcept;

} // namespace webots_cloud::adapters
