// What every fuzz target needs.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

/// libFuzzer calls it with one input after the other; 0: go on.
extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size);

namespace webots_cloud::fuzz {

inline std::string_view text_of(std::uint8_t const* data, std::size_t size)
{
    return {reinterpret_cast<char const*>(data), size};
}

/// Something that must hold for every input.
inline void require(bool condition)
{
    if (!condition)
        std::abort();
}

/// Takes the first byte off; 0 when there is none.
inline unsigned take_byte(std::string_view& text)
{
    if (text.empty())
        return 0;
    auto const byte = static_cast<unsigned char>(text.front());
    text.remove_prefix(1);
    return byte;
}

/// Takes so many bytes off, or as many as there are.
inline std::string_view take(std::string_view& text, std::size_t count)
{
    auto const taken = text.substr(0, count);
    text.remove_prefix(taken.size());
    return taken;
}

/// True when the path, however it is read, stays below the folder where it starts.
inline bool stays_inside(std::string_view path)
{
    if (path.empty() || path.front() == '/' || path.find('\0') != std::string_view::npos ||
        path.find('\\') != std::string_view::npos)
        return false;
    for (std::size_t at = 0; at <= path.size();) {
        auto const end = std::min(path.find('/', at), path.size());
        auto const part = path.substr(at, end - at);
        if (part.empty() || part == "." || part == "..")
            return false;
        at = end + 1;
    }
    return true;
}

} // namespace webots_cloud::fuzz
