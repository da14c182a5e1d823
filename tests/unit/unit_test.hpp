// What every unit test includes: Boost.Test, and how our values look in its messages.
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/test/unit_test.hpp>

#include <ostream>

namespace webots_cloud {

inline std::ostream& operator<<(std::ostream& out, Failure const& failure)
{
    return out << failure.code() << " \"" << failure.message() << '"';
}

} // namespace webots_cloud
