#include <webots_cloud/adapters.hpp>

#include <random>
#include <string_view>

namespace webots_cloud {

std::string make_token()
{
    constexpr std::string_view digits = "0123456789abcdef";
    std::random_device numbers("getentropy");
    std::string token;
    while (token.size() < 32)
        token += digits[numbers() % digits.size()];
    return token;
}

std::string random_bytes(std::size_t size)
{
    std::random_device numbers("getentropy");
    std::string bytes;
    while (bytes.size() < size)
        bytes += static_cast<char>(numbers() & 0xff);
    return bytes;
}

} // namespace webots_cloud
