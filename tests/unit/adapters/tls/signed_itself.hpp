// A certificate for tests of TLS.
#pragma once

#include <webots_cloud/adapters.hpp>

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <unistd.h>

namespace webots_cloud {

/// A certificate that has signed itself, and its key, in files of their own.
class SignedItself
{
public:
    explicit SignedItself(std::string const& name,
                          char const* alternative_names = "DNS:localhost,IP:127.0.0.1",
                          long valid_for = 86'400)
        : folder_(std::filesystem::temp_directory_path() /
                  ("webots_cloud_certificate_" + name + std::to_string(::getpid())))
    {
        std::filesystem::create_directories(folder_);
        auto* const key_pair = EVP_EC_gen("P-256");
        auto* const made = X509_new();
        X509_set_version(made, X509_VERSION_3);
        ASN1_INTEGER_set(X509_get_serialNumber(made), 1);
        X509_NAME_add_entry_by_txt(X509_get_subject_name(made), "CN", MBSTRING_ASC,
                                   reinterpret_cast<unsigned char const*>(name.c_str()), -1, -1, 0);
        X509_set_issuer_name(made, X509_get_subject_name(made));
        X509_gmtime_adj(X509_getm_notBefore(made), std::min(valid_for, 0L) - 60);
        X509_gmtime_adj(X509_getm_notAfter(made), valid_for);
        X509_set_pubkey(made, key_pair);
        auto* const names = X509V3_EXT_conf_nid(nullptr, nullptr, NID_subject_alt_name, alternative_names);
        X509_add_ext(made, names, -1);
        X509_sign(made, key_pair, EVP_sha256());
        auto* const certificate_file = std::fopen(certificate().c_str(), "we");
        PEM_write_X509(certificate_file, made);
        std::fclose(certificate_file);
        auto* const key_file = std::fopen(key().c_str(), "we");
        PEM_write_PrivateKey(key_file, key_pair, nullptr, nullptr, 0, nullptr, nullptr);
        std::fclose(key_file);
        X509_EXTENSION_free(names);
        X509_free(made);
        EVP_PKEY_free(key_pair);
    }
    SignedItself(SignedItself const&) = delete;
    SignedItself& operator=(SignedItself const&) = delete;
    ~SignedItself() { std::filesystem::remove_all(folder_); }

    std::filesystem::path certificate() const { return folder_ / "certificate.pem"; }
    std::filesystem::path key() const { return folder_ / "key.pem"; }

    /// Of a server that shows it.
    HttpServerParams shown() const
    {
        HttpServerParams params;
        params.network.ssl_certificate = certificate();
        params.network.ssl_key = key();
        return params;
    }

    /// Of a gateway that trusts it.
    HttpServerParams trusted() const
    {
        HttpServerParams params;
        params.tls_authorities = certificate();
        return params;
    }

private:
    std::filesystem::path folder_;
};

} // namespace webots_cloud
