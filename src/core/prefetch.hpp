// Loads of memory that overlap with other work.
#pragma once

#include <cstddef>

namespace webots_cloud::core {

/// Has the processor load the first 192 bytes of an object that is about to be used, while it does other
/// work; null is ignored.
inline void prefetch(void const* object) noexcept
{
    constexpr std::size_t line = 64;
    for (std::size_t offset = 0; offset < 3 * line; offset += line)
        __builtin_prefetch(static_cast<std::byte const*>(object) + offset);
}

} // namespace webots_cloud::core
