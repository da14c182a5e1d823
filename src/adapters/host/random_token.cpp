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

} // namespace webots_cloud
