// Names of git objects for tests.
#pragma once

#include "core/git/git_object_id.hpp"

#include <cstdint>

/// One for each number from 0 to 65535.
inline webots_cloud::core::GitObjectId id(int number)
{
    webots_cloud::core::GitObjectId made;
    made.bytes[0] = static_cast<std::uint8_t>(number >> 8);
    made.bytes[1] = static_cast<std::uint8_t>(number);
    return made;
}
