// Base64 (RFC 4648, section 4).
#pragma once

#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>

#include <algorithm>
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

} // namespace webots_cloud::core
