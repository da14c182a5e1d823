// What the environment of the process and the working folder say of programs and paths.
#pragma once

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>

namespace webots_cloud::app {

/// Empty where there is no such variable.
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

/// What starts at the folder that we run in; simulators run in others.
inline std::filesystem::path from_here(std::filesystem::path const& path)
{
    std::error_code failed;
    auto const found = path.empty() ? path : std::filesystem::absolute(path, failed);
    return failed ? path : found;
}

} // namespace webots_cloud::app
