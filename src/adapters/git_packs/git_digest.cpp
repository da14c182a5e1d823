#include "git_digest.hpp"

#include <openssl/evp.h>

namespace webots_cloud::adapters {

void GitDigest::Free::operator()(evp_md_ctx_st* context) const noexcept
{
    EVP_MD_CTX_free(context);
}

GitDigest::GitDigest() : context_(EVP_MD_CTX_new())
{
    begin();
}

void GitDigest::begin()
{
    EVP_DigestInit_ex(context_.get(), EVP_sha1(), nullptr);
}

void GitDigest::update(std::string_view bytes)
{
    EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size());
}

core::GitObjectId GitDigest::finish()
{
    core::GitObjectId id;
    unsigned size = 0;
    EVP_DigestFinal_ex(context_.get(), id.bytes.data(), &size);
    begin();
    return id;
}

} // namespace webots_cloud::adapters
