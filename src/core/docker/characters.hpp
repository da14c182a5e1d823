// The characters of names that containers are told.
#pragma once

#include <algorithm>
#include <string_view>

namespace webots_cloud::core {

inline bool is_letter(char c) noexcept
{
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

inline bool is_digit(char c) noexcept
{
    return c >= '0' && c <= '9';
}

/// Letters and digits of ASCII, and `others`.
inline bool consists_of(std::string_view text, std::string_view others)
{
    return std::all_of(text.begin(), text.end(), [&](char c) {
        return is_letter(c) || is_digit(c) || others.find(c) != std::string_view::npos;
    });
}

} // namespace webots_cloud::core
