// What every unit test includes: Boost.Test, and how our values look in its messages.
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/test/unit_test.hpp>

#include <ostream>

namespace webots_cloud {

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define WEBOTS_CLOUD_SANITIZED
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define WEBOTS_CLOUD_SANITIZED
#endif

/// Whether a sanitizer makes this test ten times slower.
#ifdef WEBOTS_CLOUD_SANITIZED
inline constexpr bool is_sanitized = true;
#else
inline constexpr bool is_sanitized = false;
#endif

inline std::ostream& operator<<(std::ostream& out, Failure const& failure)
{
    return out << failure.code() << " \"" << failure.message() << '"';
}

} // namespace webots_cloud
