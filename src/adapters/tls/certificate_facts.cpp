#include "certificate_facts.hpp"

#include "adapters/files/regular_file.hpp"
#include "core/text.hpp"
#include "openssl_files.hpp"
#include "tls_trust.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <boost/asio/ip/address.hpp>

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <ctime>
#include <vector>

namespace webots_cloud::adapters {
namespace {

using core::concat;

constexpr int least_security = 112; // as RSA of 2048 bits, which browsers and Debian's OpenSSL want

using CertificateStack =
    std::unique_ptr<STACK_OF(X509),
                    decltype([](STACK_OF(X509) * stack) { sk_X509_pop_free(stack, X509_free); })>;
using Verification = std::unique_ptr<X509_STORE_CTX, OpensslFree<X509_STORE_CTX_free>>;

WallTime time_of(ASN1_TIME const* time)
{
    std::tm calendar{};
    if (ASN1_TIME_to_tm(time, &calendar) != 1)
        return {};
    return std::chrono::system_clock::from_time_t(::timegm(&calendar));
}

std::string common_name(X509_NAME const* name)
{
    char text[256] = "";
    if (X509_NAME_get_text_by_NID(name, NID_commonName, text, sizeof text) < 0)
        return "somebody without a name";
    return core::printable(text, sizeof text);
}

bool is_for(X509* certificate, std::string const& host)
{
    boost::system::error_code error;
    (void)boost::asio::ip::make_address(host, error);
    return (error ? X509_check_host(certificate, host.data(), host.size(), 0, nullptr)
                  : X509_check_ip_asc(certificate, host.c_str(), 0)) == 1;
}

/// Whatever the time is: that it has expired is another matter.
std::string problem_of_chain(X509* certificate, STACK_OF(X509) * chain, SSL_CTX* trust)
{
    Verification const verification(X509_STORE_CTX_new());
    if (!verification ||
        X509_STORE_CTX_init(verification.get(), SSL_CTX_get_cert_store(trust), certificate, chain) != 1)
        return openssl_reason();
    X509_STORE_CTX_set_default(verification.get(), "ssl_server");
    X509_VERIFY_PARAM_set_flags(X509_STORE_CTX_get0_param(verification.get()), X509_V_FLAG_NO_CHECK_TIME);
    if (X509_verify_cert(verification.get()) == 1)
        return {};
    return X509_verify_cert_error_string(X509_STORE_CTX_get_error(verification.get()));
}

} // namespace

result<core::CertificateFacts> read_certificate(std::filesystem::path const& certificate,
                                                std::string const& host,
                                                std::filesystem::path const& authorities)
{
    ERR_clear_error();
    auto const text = read_regular_file(certificate, max_pem_file);
    if (!text)
        return Failure(errc::invalid_config, concat("the certificate ", certificate.string(),
                                                    " can't be read: ", text.error().message()));
    OpensslBio const bio(BIO_new_mem_buf(text->data(), static_cast<int>(text->size())));
    auto const next = [&bio] {
        return OpensslCertificate(bio ? PEM_read_bio_X509(bio.get(), nullptr, no_passphrase, nullptr)
                                      : nullptr);
    };
    auto const own = next();
    if (!own)
        return Failure(errc::invalid_config,
                       concat("the certificate ", certificate.string(), " can't be read: ",
                              reading_reason("a PEM file with \"-----BEGIN CERTIFICATE-----\"")));
    CertificateStack const chain(sk_X509_new_null());
    while (auto above = next())
        if (chain && sk_X509_push(chain.get(), above.get()) > 0)
            (void)above.release();
    // Reading on to the end of the file has left an error.
    ERR_clear_error();
    auto const trust = load_trust(authorities);
    if (!trust)
        return trust.error();
    core::CertificateFacts facts;
    facts.names = names_of(own.get());
    facts.issuer = common_name(X509_get_issuer_name(own.get()));
    facts.begins = time_of(X509_get0_notBefore(own.get()));
    facts.ends = time_of(X509_get0_notAfter(own.get()));
    auto const* const key = X509_get0_pubkey(own.get());
    facts.key_bits = key ? EVP_PKEY_get_bits(key) : 0;
    facts.is_weak = key && EVP_PKEY_get_security_bits(key) < least_security;
    facts.fits = host.empty() || is_for(own.get(), host);
    facts.chain_problem = problem_of_chain(own.get(), chain.get(), trust->get());
    ERR_clear_error();
    return facts;
}

} // namespace webots_cloud::adapters
