#include "tls_certificate.hpp"

#include "adapters/files/regular_file.hpp"
#include "core/text.hpp"
#include "openssl_files.hpp"

#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/http_server.hpp>

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <chrono>
#include <ctime>
#include <memory>

namespace webots_cloud::adapters {
namespace {

using core::concat;

// Of TLS 1.2: forward secrecy and authenticated encryption, as of TLS 1.3, whose own list is good as it is.
// Somebody who records the traffic and gets the key years later reads nothing.
constexpr auto ciphers = "ECDHE+AESGCM:ECDHE+CHACHA20";

Failure unusable(std::string_view what, std::filesystem::path const& file, std::string_view why)
{
    return Failure(errc::invalid_config, concat("the ", what, " ", file.string(), " can't be used: ", why));
}

/// Takes the certificate that a text begins with, and those after it as its chain; false: OpenSSL says why.
bool use_certificates(SSL_CTX* context, std::string const& text)
{
    OpensslBio const bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
    OpensslCertificate const own(bio ? PEM_read_bio_X509_AUX(bio.get(), nullptr, no_passphrase, nullptr)
                                     : nullptr);
    if (!own || SSL_CTX_use_certificate(context, own.get()) != 1)
        return false;
    while (OpensslCertificate next{PEM_read_bio_X509(bio.get(), nullptr, no_passphrase, nullptr)})
        if (SSL_CTX_add0_chain_cert(context, next.get()) == 1)
            (void)next.release();
    return was_last_part();
}

bool use_key(SSL_CTX* context, std::string const& text)
{
    OpensslBio const bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
    OpensslKey const key(bio ? PEM_read_bio_PrivateKey(bio.get(), nullptr, no_passphrase, nullptr) : nullptr);
    return key && SSL_CTX_use_PrivateKey(context, key.get()) == 1;
}

} // namespace

void TlsContextDeleter::operator()(SSL_CTX* context) const noexcept
{
    SSL_CTX_free(context);
}

result<TlsContext> load_tls_context(std::filesystem::path const& certificate,
                                    std::filesystem::path const& key)
{
    ERR_clear_error();
    TlsContext context(SSL_CTX_new(TLS_server_method()));
    if (!context)
        return Failure(errc::unavailable, concat("TLS can't be used: ", openssl_reason()));
    SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
    if (SSL_CTX_set_cipher_list(context.get(), ciphers) != 1)
        return Failure(errc::unavailable, concat("TLS can't be used: ", openssl_reason()));
    SSL_CTX_set_options(context.get(), SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION |
                                           SSL_OP_CIPHER_SERVER_PREFERENCE | SSL_OP_PRIORITIZE_CHACHA |
                                           SSL_OP_IGNORE_UNEXPECTED_EOF);
    // Thousands of browsers are silent most of the time: their connections hold no buffers meanwhile.
    SSL_CTX_set_mode(context.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                        SSL_MODE_RELEASE_BUFFERS);
    SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF); // tickets do the same without memory
    SSL_CTX_set_default_passwd_cb(context.get(), no_passphrase);
    auto const certificate_text = read_regular_file(certificate, max_pem_file);
    if (!certificate_text)
        return unusable("certificate", certificate, certificate_text.error().message());
    if (!use_certificates(context.get(), *certificate_text))
        return unusable("certificate", certificate,
                        reading_reason("a PEM file with \"-----BEGIN CERTIFICATE-----\""));
    auto const key_text = read_regular_file(key, max_pem_file);
    if (!key_text)
        return unusable("key", key, key_text.error().message());
    if (!use_key(context.get(), *key_text)) {
        bool const is_other = ERR_GET_REASON(ERR_peek_last_error()) == X509_R_KEY_VALUES_MISMATCH;
        auto const reason = reading_reason("a PEM file with a private key that has no passphrase");
        return unusable("key", key,
                        is_other ? concat("it is not the key of the certificate ", certificate.string())
                                 : reason);
    }
    if (SSL_CTX_check_private_key(context.get()) != 1)
        return unusable("key", key, openssl_reason());
    return context;
}

std::string TlsCertificate::stamp() const
{
    return concat(file_stamp(certificate_), ", ", file_stamp(key_));
}

result<> TlsCertificate::load()
{
    loaded_ = seen_ = stamp();
    auto context = load_tls_context(certificate_, key_);
    if (!context)
        return context.error();
    context_ = std::move(*context);
    return {};
}

void TlsCertificate::renew()
{
    auto const now = stamp();
    bool const has_settled =
        now == std::exchange(seen_, now); // certificate and key are seldom written at the same moment
    if (!has_settled || now == loaded_)
        return;
    if (auto const renewed = load(); renewed)
        log_.info(concat("The certificate ", certificate_.string(), " was read again"));
    else
        log_.error(concat("The certificate stays as it was: ", renewed.error().message()));
}

WallTime TlsCertificate::expires() const noexcept
{
    std::tm date{};
    if (ASN1_TIME_to_tm(X509_get0_notAfter(SSL_CTX_get0_certificate(context_.get())), &date) != 1)
        return {};
    return std::chrono::system_clock::from_time_t(::timegm(&date));
}

} // namespace webots_cloud::adapters

namespace webots_cloud {

result<> check_certificate(std::filesystem::path const& certificate, std::filesystem::path const& key)
{
    auto const loaded = adapters::load_tls_context(certificate, key);
    return loaded ? result<>() : result<>(loaded.error());
}

} // namespace webots_cloud
