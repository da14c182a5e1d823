#include "git_object_id.hpp"

namespace webots_cloud::core {
namespace {

int digit(char c) noexcept
{
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

} // namespace

std::string to_hex(GitObjectId const& id)
{
    constexpr char digits[] = "0123456789abcdef";
    std::string text;
    text.reserve(2 * id.bytes.size());
    for (auto const byte : id.bytes) {
        text += digits[byte >> 4];
        text += digits[byte & 15];
    }
    return text;
}

std::optional<GitObjectId> git_object_id(std::string_view hex) noexcept
{
    GitObjectId id;
    if (hex.size() != 2 * id.bytes.size())
        return std::nullopt;
    for (std::size_t i = 0; i < id.bytes.size(); ++i) {
        int const high = digit(hex[2 * i]);
        int const low = digit(hex[2 * i + 1]);
        if (high < 0 || low < 0)
            return std::nullopt;
        id.bytes[i] = static_cast<std::uint8_t>(high * 16 + low);
    }
    return id;
}

} // namespace webots_cloud::core
