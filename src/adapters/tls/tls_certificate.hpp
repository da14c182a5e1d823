// The certificate of a server, and its renewal while the server runs.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <openssl/types.h>

#include <filesystem>
#include <memory>
#include <string>

namespace webots_cloud::adapters {

struct TlsContextDeleter
{
    void operator()(SSL_CTX* context) const noexcept;
};

/// Everything that new TLS connections have in common; those that exist keep theirs alive.
using TlsContext = std::unique_ptr<SSL_CTX, TlsContextDeleter>;

/// A context for TLS 1.2 and 1.3 with a certificate (its chain after it) and its key, both PEM.
///
/// Errors: `invalid_config`, naming the file: it can't be read, is no PEM, or the key belongs to another
/// certificate.
result<TlsContext> load_tls_context(std::filesystem::path const& certificate,
                                    std::filesystem::path const& key);

/// Keeps the context for new connections, and makes another when the files have changed.
class TlsCertificate
{
public:
    TlsCertificate(std::filesystem::path certificate, std::filesystem::path key, Logger log)
        : certificate_(std::move(certificate)), key_(std::move(key)), log_(std::move(log))
    {}

    /// Errors: as `load_tls_context`.
    result<> load();

    /// Checks whether the files have changed, and loads them once they have stopped changing: to be called
    /// once a second.
    ///
    /// Files that are unusable are logged once, and the certificate stays as it was.
    void renew();

    /// For the next connection. Precondition: `load` succeeded.
    SSL_CTX* context() const noexcept { return context_.get(); }

    /// When the certificate expires. Precondition: `load` succeeded.
    WallTime expires() const noexcept;

private:
    std::string stamp() const;

    std::filesystem::path certificate_;
    std::filesystem::path key_;
    Logger log_;
    TlsContext context_;
    std::string loaded_; ///< What the files looked like when they were read last.
    std::string seen_;   ///< What they looked like a second ago.
};

} // namespace webots_cloud::adapters
