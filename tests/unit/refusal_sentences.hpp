// What people are told, as tests expect it: which refusal, and what varies in its sentence. The words are
// those of the table (core/refusals), so a test does not follow when they change.
#pragma once

#include "core/refusals.hpp"

#include <string>

namespace webots_cloud {

inline std::string sentence(core::Refused which, core::RefusalArguments arguments = {})
{
    return core::refused(which, arguments).message();
}

/// As browsers on /client get it.
inline std::string error_line(core::Refused which, core::RefusalArguments arguments = {})
{
    return "loading: Error: " + sentence(which, arguments);
}

} // namespace webots_cloud
