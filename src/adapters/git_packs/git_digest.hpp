// SHA-1 over OpenSSL, piece by piece.
#pragma once

#include "core/git/git_object_id.hpp"

#include <memory>
#include <string_view>

struct evp_md_ctx_st;

namespace webots_cloud::adapters {

/// A SHA-1 computation.   Thread-safety: one thread at a time.
class GitDigest
{
public:
    GitDigest();

    void update(std::string_view bytes);

    /// The digest of everything since the start or the last call; begins anew.
    core::GitObjectId finish();

private:
    struct Free
    {
        void operator()(evp_md_ctx_st* context) const noexcept;
    };

    void begin();

    std::unique_ptr<evp_md_ctx_st, Free> context_;
};

} // namespace webots_cloud::adapters
