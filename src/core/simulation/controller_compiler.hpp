// How the controllers of a project that are written in C or C++ are compiled: by the makefiles of the
// simulator, as its own editor does it.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// The makefile of a simulator for controllers that have none of their own.
std::filesystem::path common_makefile(std::filesystem::path const& home);

/// The command line that compiles what is in a folder, by its own makefile or the common one of `home`.
std::vector<std::string> compile_command(std::filesystem::path const& make, std::filesystem::path const& home,
                                         std::filesystem::path const& folder, bool has_makefile);

/// What a compiler gets beside the environment of simulators. Its messages are English, for pages that look
/// for them.
std::vector<std::pair<std::string, std::string>> compile_variables(std::filesystem::path const& home);

/// What a compiler has printed, for a visitor: without the place of `home` on this machine.
std::string without_home(std::string printed, std::filesystem::path const& home);

} // namespace webots_cloud::core
