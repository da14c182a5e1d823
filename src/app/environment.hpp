// Environment variables, programs, and paths relative to the working directory.
#pragma once

#include "core/text.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::app {

/// The value of a variable; empty when it is not set.
inline std::string environment(char const* name)
{
    char const* const value = std::getenv(name);
    return value ? value : "";
}

/// All variables.
inline std::vector<std::pair<std::string, std::string>> current_environment()
{
    std::vector<std::pair<std::string, std::string>> variables;
    for (char** entry = environ; entry && *entry; ++entry) {
        std::string const variable = *entry;
        auto const equals = variable.find('=');
        if (equals != std::string::npos)
            variables.emplace_back(variable.substr(0, equals), variable.substr(equals + 1));
    }
    return variables;
}

/// The folder for temporary files; `/tmp` where `TMPDIR` names none.
inline std::filesystem::path temporary_folder()
{
    std::error_code failed;
    auto const found = std::filesystem::temp_directory_path(failed);
    return failed ? std::filesystem::path("/tmp") : found;
}

inline bool is_program(std::filesystem::path const& path)
{
    std::error_code failed;
    return ::access(path.c_str(), X_OK) == 0 && !std::filesystem::is_directory(path, failed);
}

/// The path of a program that is found by PATH; empty when there is none.
inline std::filesystem::path find_program(std::string_view name)
{
    auto const path = environment("PATH");
    for (std::filesystem::path const folder : core::split(path, ':'))
        if (folder.is_absolute() && is_program(folder / name))
            return folder / name;
    return {};
}

/// The same, where the programs of administrators are too, which are not on everybody's PATH.
inline std::filesystem::path find_system_program(std::string_view name)
{
    auto found = find_program(name);
    for (std::filesystem::path const folder : {"/usr/sbin", "/sbin", "/usr/bin"})
        if (found.empty() && is_program(folder / name))
            found = folder / name;
    return found;
}

/// An absolute path: simulators run in other working directories.
inline std::filesystem::path absolute_path(std::filesystem::path const& path)
{
    std::error_code failed;
    auto const found = path.empty() ? path : std::filesystem::absolute(path, failed);
    return failed ? path : found;
}

/// The file with the password of the X display; empty: there is none.
inline std::filesystem::path x_authority()
{
    std::error_code failed;
    auto file = std::filesystem::path(environment("XAUTHORITY"));
    if (file.empty() && !environment("HOME").empty())
        file = std::filesystem::path(environment("HOME")) / ".Xauthority";
    return std::filesystem::is_regular_file(file, failed) ? absolute_path(file) : std::filesystem::path();
}

} // namespace webots_cloud::app
