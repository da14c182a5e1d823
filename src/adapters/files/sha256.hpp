// SHA-256 over OpenSSL, piece by piece.
#pragma once

#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace webots_cloud::adapters {

/// One computation.   Thread-safety: one thread at a time.
class Sha256
{
public:
    Sha256();

    void update(std::string_view bytes);

    /// 64 lower-case hexadecimal digits, once.
    std::string finish();

private:
    struct Free
    {
        void operator()(evp_md_ctx_st* context) const noexcept;
    };

    std::unique_ptr<evp_md_ctx_st, Free> context_;
};

} // namespace webots_cloud::adapters
