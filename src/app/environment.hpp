// Environment variables, programs, and paths relative to the working directory.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace webots_cloud::app {

/// The value of a variable; empty when it is not set.
inline std::string environment(char const* name)
{
    char const* const value = std::getenv(name);
    return value ? value : "";
}

inline bool is_program(std::filesystem::path const& path)
{
    std::error_code failed;
    return ::access(path.c_str(), X_OK) == 0 && !std::filesystem::is_directory(path, failed);
}

/// An absolute path: simulators run in other working directories.
inline std::filesystem::path absolute_path(std::filesystem::path const& path)
{
    std::error_code failed;
    auto const found = path.empty() ? path : std::filesystem::absolute(path, failed);
    return failed ? path : found;
}

} // namespace webots_cloud::app
