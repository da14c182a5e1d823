#include "secret_file.hpp"

#include <webots_cloud/adapters.hpp>

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>

namespace webots_cloud {

result<std::function<std::string(std::string_view)>> make_ticket_mac(std::filesystem::path const& file)
{
    auto secret = adapters::read_secret(file, "the secret of the session servers");
    if (!secret)
        return secret.error();
    return [secret = std::move(*secret)](std::string_view message) {
        std::array<unsigned char, EVP_MAX_MD_SIZE> code{};
        unsigned size = 0;
        HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()),
             reinterpret_cast<unsigned char const*>(message.data()), message.size(), code.data(), &size);
        return std::string(reinterpret_cast<char const*>(code.data()), size);
    };
}

} // namespace webots_cloud
