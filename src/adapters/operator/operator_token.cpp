#include "secret_file.hpp"

#include "core/text.hpp"

#include <webots_cloud/adapters/operator.hpp>

#include <openssl/crypto.h>
#include <openssl/evp.h>

#include <algorithm>
#include <array>

namespace webots_cloud {
namespace {

using core::concat;
using Digest = std::array<unsigned char, 32>;

constexpr std::string_view hashed = "sha256:";

Digest sha256(std::string_view text)
{
    Digest digest{};
    EVP_Q_digest(nullptr, "SHA256", nullptr, text.data(), text.size(), digest.data(), nullptr);
    return digest;
}

bool read_digits(std::string_view digits, Digest& digest)
{
    if (digits.size() != 2 * digest.size())
        return false;
    for (std::size_t i = 0; i < digest.size(); ++i) {
        int const high = core::hex_digit(digits[2 * i]);
        int const low = core::hex_digit(digits[2 * i + 1]);
        if (high < 0 || low < 0)
            return false;
        digest[i] = static_cast<unsigned char>(16 * high + low);
    }
    return true;
}

} // namespace

result<std::function<bool(std::string_view)>> make_operator_token_check(std::filesystem::path const& file)
{
    auto const text = adapters::read_secret(file, "the operator's token");
    if (!text)
        return text.error();
    std::string_view const word = *text;
    Digest expected = sha256(word);
    if (word.starts_with(hashed) && !read_digits(word.substr(hashed.size()), expected))
        return Failure(errc::invalid_config, concat("the operator's token in ", file.string(),
                                                    ": expected 64 hexadecimal digits after \"sha256:\""));
    return [expected](std::string_view token) {
        auto const given = sha256(token);
        return CRYPTO_memcmp(given.data(), expected.data(), expected.size()) == 0;
    };
}

} // namespace webots_cloud
