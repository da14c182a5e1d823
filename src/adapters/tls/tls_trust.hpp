// Which servers we trust when we connect to them by TLS.
#pragma once

#include "tls_certificate.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <openssl/types.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// A context for connections to other servers, whose certificates are verified: by the authorities of the
/// system and, unless it is empty, by the certificates in the PEM file `authorities`, which may be those of
/// authorities, or of the servers themselves.
///
/// Errors: `invalid_config`, naming the file: it can't be read, or has no certificate.
result<TlsContext> load_trust(std::filesystem::path const& authorities);

/// Keeps that context, and makes another when the file has changed.
///
/// Thread-safety: one executor.
class TlsTrust
{
public:
    /// `authorities` as for `load_trust`. Nothing is read before the first connection.
    TlsTrust(std::filesystem::path authorities, Logger log)
        : authorities_(std::move(authorities)), log_(std::move(log))
    {}

    /// For the next connection. A file that has changed and is unusable is logged once; then the context
    /// stays as it was.
    ///
    /// Errors: as `load_trust`, while there has been none.
    result<SSL_CTX*> context();

private:
    std::filesystem::path authorities_;
    Logger log_;
    TlsContext context_;
    std::string seen_; ///< What the file looked like when it was read last.
};

/// The names and addresses that a certificate is for, as in "robots.example.org, 10.0.0.1".
std::string names_of(X509 const* certificate);

/// Adds the certificates of a PEM file's text to whom `context` trusts. False: there is none, or a bad one;
/// OpenSSL says why.
bool trust_certificates(SSL_CTX* context, std::string const& text);

/// Has `tls` accept only a certificate for `host`, a name or a numeric address, and tells the server the
/// name. False: out of memory.
bool expect_host(SSL* tls, std::string const& host);

/// What is wrong with the certificate that the server of `tls` has shown, as a part of a sentence; empty:
/// nothing was found. `tls` is of a context of `load_trust`.
std::string certificate_problem(SSL const* tls);

/// Why a handshake failed. `openssl_error` is the first that OpenSSL has noted, `otherwise` what else is
/// known.
std::string handshake_problem(SSL const* tls, unsigned long openssl_error, std::string_view otherwise);

} // namespace webots_cloud::adapters
