// Base64 (RFC 4648, section 4), and its form for addresses (section 5).
#pragma once

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

inline std::string base64(std::string_view bytes)
{
    using namespace boost::archive::iterators;
    using Digits = base64_from_binary<transform_width<std::string::const_iterator, 6, 8>>;
    auto const missing = (3 - bytes.size() % 3) % 3;
    std::string padded(bytes.size() + missing, '\0'); // the iterators read whole groups of three bytes
    bytes.copy(padded.data(), bytes.size());
    std::string text(Digits(padded.cbegin()), Digits(padded.cend()));
    std::fill_n(text.rbegin(), missing, '=');
    return text;
}

/// The digits of `base64url`, by their value.
inline constexpr std::string_view base64url_digits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

/// With `-` and `_` for `+` and `/`, and no `=` at the end.
inline std::string base64url(std::string_view bytes)
{
    auto text = base64(bytes);
    std::replace(text.begin(), text.end(), '+', '-');
    std::replace(text.begin(), text.end(), '/', '_');
    text.erase(std::min(text.size(), text.find('=')));
    return text;
}

/// The bytes of `base64url`; nothing where `text` has any other character. Bits of the last character that
/// belong to no byte are ignored.
inline std::optional<std::string> base64url_bytes(std::string_view text)
{
    std::string bytes;
    std::uint32_t bits = 0;
    int count = 0;
    for (char const c : text) {
        auto const digit = base64url_digits.find(c);
        if (digit == std::string_view::npos)
            return std::nullopt;
        bits = (bits << 6) | static_cast<std::uint32_t>(digit);
        count += 6;
        if (count >= 8) {
            count -= 8;
            bytes += static_cast<char>((bits >> count) & 0xff);
        }
    }
    return bytes;
}

} // namespace webots_cloud::core
