// The methods of HTTP that a path answers.
#pragma once

#include <cstdint>
#include <string_view>

namespace webots_cloud::core {

/// HEAD is answered as GET; the sender of the answer omits its body.
enum class Methods : std::uint8_t
{
    get,  ///< GET alone.
    read, ///< GET and HEAD.
    read_and_options,
    post
};

/// The value of the header `Allow`.
constexpr std::string_view allow_header(Methods methods) noexcept
{
    switch (methods) {
    case Methods::get:
        return "GET";
    case Methods::read:
        return "GET, HEAD";
    case Methods::read_and_options:
        return "GET, HEAD, OPTIONS";
    case Methods::post:
        break;
    }
    return "POST";
}

constexpr bool permits(Methods methods, std::string_view method) noexcept
{
    if (methods == Methods::post)
        return method == "POST";
    return method == "GET" || (methods != Methods::get && method == "HEAD") ||
           (methods == Methods::read_and_options && method == "OPTIONS");
}

} // namespace webots_cloud::core
