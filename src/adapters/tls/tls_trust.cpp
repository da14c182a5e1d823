// OpenSSL verifies; this file chooses whom to trust, and turns the first problem that it finds into a
// sentence that names the certificate. That sentence is what operators see in the log and on /monitor.
#include "tls_trust.hpp"

#include "adapters/files/regular_file.hpp"
#include "core/text.hpp"
#include "openssl_files.hpp"

#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/http_client.hpp>

#include <boost/asio/ip/address.hpp>

#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

namespace webots_cloud::adapters {
namespace {

using core::concat;

constexpr std::size_t read_at_once = 64 * 1024;
constexpr std::size_t max_names = 5;      // of a certificate, in a sentence
constexpr std::size_t max_name_size = 80; // of each

using AlternativeNames = std::unique_ptr<GENERAL_NAMES, OpensslFree<GENERAL_NAMES_free>>;

Failure unusable(std::filesystem::path const& file, std::string_view why)
{
    return Failure(errc::invalid_config,
                   concat("the certificates of \"caFile\", ", file.string(), ", can't be used: ", why));
}

void free_text(void*, void* text, CRYPTO_EX_DATA*, int, long, void*)
{
    delete static_cast<std::string*>(text);
}

/// Where a connection keeps what is wrong with the certificate that it was shown.
int problem_index()
{
    static int const index = SSL_get_ex_new_index(0, nullptr, nullptr, nullptr, free_text);
    return index;
}

std::string date_of(ASN1_TIME const* time)
{
    OpensslBio const bio(BIO_new(BIO_s_mem()));
    char text[64] = {};
    if (bio && ASN1_TIME_print(bio.get(), time) == 1)
        BIO_read(bio.get(), text, sizeof text - 1);
    return text;
}

std::optional<std::string> text_of(GENERAL_NAME const* name)
{
    if (name->type == GEN_DNS) {
        auto const* const data = reinterpret_cast<char const*>(ASN1_STRING_get0_data(name->d.dNSName));
        auto const size = static_cast<std::size_t>(ASN1_STRING_length(name->d.dNSName));
        return core::printable(std::string_view(data, size), max_name_size);
    }
    if (name->type != GEN_IPADD)
        return std::nullopt;
    auto const* const bytes = ASN1_STRING_get0_data(name->d.iPAddress);
    if (ASN1_STRING_length(name->d.iPAddress) == 4) {
        boost::asio::ip::address_v4::bytes_type address;
        std::copy_n(bytes, address.size(), address.begin());
        return boost::asio::ip::address_v4(address).to_string();
    }
    boost::asio::ip::address_v6::bytes_type address;
    if (ASN1_STRING_length(name->d.iPAddress) != static_cast<int>(address.size()))
        return std::nullopt;
    std::copy_n(bytes, address.size(), address.begin());
    return boost::asio::ip::address_v6(address).to_string();
}

/// What the macro sk_GENERAL_NAME_value does, without its C cast.
GENERAL_NAME const* name_at(GENERAL_NAMES const* names, int index)
{
    return static_cast<GENERAL_NAME const*>(
        OPENSSL_sk_value(ossl_check_const_GENERAL_NAME_sk_type(names), index));
}

/// Whom the connection was to lead to.
std::string expected_host(X509_STORE_CTX* verification)
{
    auto* const expected = X509_STORE_CTX_get0_param(verification);
    if (char const* const host = X509_VERIFY_PARAM_get0_host(expected, 0))
        return core::printable(host, max_name_size);
    char* const address = X509_VERIFY_PARAM_get1_ip_asc(expected);
    std::string text = address ? address : "this machine";
    OPENSSL_free(address);
    return text;
}

std::string describe(X509_STORE_CTX* verification)
{
    auto const* const certificate = X509_STORE_CTX_get_current_cert(verification);
    int const error = X509_STORE_CTX_get_error(verification);
    if (!certificate)
        return concat("its certificate is refused: ", X509_verify_cert_error_string(error));
    // Of an authority above it, perhaps.
    std::string_view const whose =
        X509_STORE_CTX_get_error_depth(verification) > 0 ? "a certificate above its own" : "its certificate";
    switch (error) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
        return concat(whose, " expired on ", date_of(X509_get0_notAfter(certificate)),
                      ": renew it there, or set the clocks");
    case X509_V_ERR_CERT_NOT_YET_VALID:
        return concat(whose, " is not valid before ", date_of(X509_get0_notBefore(certificate)),
                      ": set the clocks");
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
        return concat("its certificate is for ", names_of(certificate), ", not for ",
                      expected_host(verification), ": ask for it by a name of its certificate");
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
        return "no authority that this server trusts has signed its certificate: put that of its authority, "
               "or its own if it is self-signed, into \"caFile\"";
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT:
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
        return "its certificate is from an authority that we do not know: put the authority's certificate "
               "into "
               "\"caFile\", or have the machine show its whole chain";
    default:
        return concat(whose, " is refused: ", X509_verify_cert_error_string(error));
    }
}

/// Notes the first problem that OpenSSL finds, and lets nothing pass that OpenSSL does not.
int note_problem(int is_good, X509_STORE_CTX* verification)
{
    if (is_good == 1)
        return 1;
    auto* const tls =
        static_cast<SSL*>(X509_STORE_CTX_get_ex_data(verification, SSL_get_ex_data_X509_STORE_CTX_idx()));
    if (tls && !SSL_get_ex_data(tls, problem_index())) {
        auto problem = std::make_unique<std::string>(describe(verification));
        if (SSL_set_ex_data(tls, problem_index(), problem.get()) == 1)
            (void)problem.release();
    }
    return 0;
}

} // namespace

bool trust_certificates(SSL_CTX* context, std::string const& text)
{
    OpensslBio const bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
    auto* const store = SSL_CTX_get_cert_store(context);
    std::size_t count = 0;
    while (OpensslCertificate next{bio ? PEM_read_bio_X509(bio.get(), nullptr, no_passphrase, nullptr)
                                       : nullptr}) {
        if (X509_STORE_add_cert(store, next.get()) != 1)
            return false;
        ++count;
    }
    return count > 0 && was_last_part();
}

std::string names_of(X509 const* certificate)
{
    AlternativeNames const names(
        static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(certificate, NID_subject_alt_name, nullptr, nullptr)));
    std::string text;
    std::size_t count = 0;
    for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
        auto const name = text_of(name_at(names.get(), i));
        if (!name)
            continue;
        if (count == max_names)
            return text.append(", ...");
        text.append(count++ == 0 ? "" : ", ").append(*name);
    }
    return text.empty() ? "no name at all" : text;
}

result<TlsContext> load_trust(std::filesystem::path const& authorities)
{
    ERR_clear_error();
    TlsContext context(SSL_CTX_new(TLS_client_method()));
    if (!context)
        return Failure(errc::unavailable, concat("TLS can't be used: ", openssl_reason()));
    SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION);
    SSL_CTX_set_options(context.get(), SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION);
    SSL_CTX_set_mode(context.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                        SSL_MODE_RELEASE_BUFFERS);
    SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);
    // Reads four records at once, where OpenSSL by itself reads the head of one, and then the rest of it.
    SSL_CTX_set_read_ahead(context.get(), 1);
    SSL_CTX_set_default_read_buffer_len(context.get(), read_at_once);
    SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, note_problem);
    SSL_CTX_set_default_verify_paths(context.get()); // where there are none, the file may be enough
    ERR_clear_error();
    if (authorities.empty())
        return context;
    auto const text = read_regular_file(authorities, max_pem_file);
    if (!text)
        return unusable(authorities, text.error().message());
    if (!trust_certificates(context.get(), *text))
        return unusable(authorities, reading_reason("a PEM file with \"-----BEGIN CERTIFICATE-----\""));
    // A certificate in the file is trusted as it is, whoever has signed it.
    X509_VERIFY_PARAM_set_flags(SSL_CTX_get0_param(context.get()), X509_V_FLAG_PARTIAL_CHAIN);
    return context;
}

result<SSL_CTX*> TlsTrust::context()
{
    auto now = authorities_.empty() ? std::string() : file_stamp(authorities_);
    if (context_ && now == seen_)
        return context_.get();
    auto const is_first = !context_;
    auto loaded = load_trust(authorities_);
    seen_ = std::move(now);
    if (!loaded) {
        if (is_first)
            return loaded.error();
        log_.error(
            concat("The certificates that this server trusts stay as they were: ", loaded.error().message()));
        return context_.get();
    }
    context_ = std::move(*loaded);
    if (!is_first)
        log_.info(concat("The certificates of \"caFile\", ", authorities_.string(), ", were read again"));
    return context_.get();
}

bool expect_host(SSL* tls, std::string const& host)
{
    boost::system::error_code no_address;
    auto const address = boost::asio::ip::make_address(host, no_address);
    if (!no_address)
        return X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(tls), address.to_string().c_str()) == 1;
    SSL_set_hostflags(tls, X509_CHECK_FLAG_NO_PARTIAL_WILDCARDS);
    // What the macro SSL_set_tlsext_host_name does, without its C casts.
    return SSL_set1_host(tls, host.c_str()) == 1 &&
           SSL_ctrl(tls, SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name,
                    const_cast<char*>(host.c_str())) == 1;
}

std::string certificate_problem(SSL const* tls)
{
    auto const* const problem = static_cast<std::string const*>(SSL_get_ex_data(tls, problem_index()));
    return problem ? *problem : std::string();
}

std::string handshake_problem(SSL const* tls, unsigned long openssl_error, std::string_view otherwise)
{
    if (auto problem = certificate_problem(tls); !problem.empty())
        return problem;
    // What came is no TLS, as the answer of a server of plain HTTP.
    if (ERR_GET_LIB(openssl_error) == ERR_LIB_SSL &&
        ERR_GET_REASON(openssl_error) == SSL_R_WRONG_VERSION_NUMBER)
        return "it was asked by https, and speaks no TLS (perhaps plain http)";
    char const* const reason = openssl_error != 0 ? ERR_reason_error_string(openssl_error) : nullptr;
    return concat("TLS failed: ", reason ? std::string_view(reason) : otherwise);
}

} // namespace webots_cloud::adapters

namespace webots_cloud {

result<> check_authorities(std::filesystem::path const& authorities)
{
    auto const loaded = adapters::load_trust(authorities);
    return loaded ? result<>() : result<>(loaded.error());
}

} // namespace webots_cloud
