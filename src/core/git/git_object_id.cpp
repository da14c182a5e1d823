#include "git_object_id.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

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
        int const high = hex_digit(hex[2 * i]);
        int const low = hex_digit(hex[2 * i + 1]);
        if (high < 0 || low < 0)
            return std::nullopt;
        id.bytes[i] = static_cast<std::uint8_t>(high * 16 + low);
    }
    return id;
}

} // namespace webots_cloud::core
