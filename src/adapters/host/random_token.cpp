#include <webots_cloud/adapters/secrets.hpp>

#include <cstddef>
#include <random>
#include <string_view>

namespace webots_cloud {

namespace {

std::string random_text(std::string_view alphabet, std::size_t length)
{
    std::random_device numbers("getentropy");
    std::string text;
    while (text.size() < length)
        text += alphabet[numbers() % alphabet.size()]; // of 2^32 numbers: the rest favours nobody visibly
    return text;
}

} // namespace

std::string make_token()
{
    return random_text("0123456789abcdef", 32);
}

std::string make_address_token()
{
    return random_text("abcdefghijklmnopqrstuvwxyz", 28);
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
