// PEM files for OpenSSL, and what it says where they are unusable.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

// A chain of certificates is some kilobytes, all authorities of a system are 220; such files are read while
// the server runs.
inline constexpr std::size_t max_pem_file = 1 << 20;

template<auto free>
struct OpensslFree
{
    template<class T>
    void operator()(T* object) const noexcept
    {
        free(object);
    }
};

using OpensslBio = std::unique_ptr<BIO, OpensslFree<BIO_free>>;
using OpensslCertificate = std::unique_ptr<X509, OpensslFree<X509_free>>;
using OpensslKey = std::unique_ptr<EVP_PKEY, OpensslFree<EVP_PKEY_free>>;

/// For functions that would ask a terminal for a passphrase: there is none.
int no_passphrase(char*, int, int, void*);

/// What OpenSSL says of a failure: its first error says what happened, the last where.
std::string openssl_reason();

/// The same of a file that is not what was wanted.
std::string reading_reason(std::string_view wanted);

/// Whether reading stopped because the file has no more PEM parts. If so, OpenSSL's errors are cleared.
bool was_last_part();

/// Changes whenever the file does, also when another one was put in its place.
std::string file_stamp(std::filesystem::path const& file);

} // namespace webots_cloud::adapters
