// How the controllers of a project that are written in C or C++ are compiled: by the makefiles of the
// simulator, as its own editor does it.
#pragma once

#include <webots_cloud/simulation_launcher.hpp>

#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// The makefile of a simulator for controllers that have none of their own.
std::filesystem::path common_makefile(std::filesystem::path const& home);

/// The command line that compiles what is in a folder.
std::vector<std::string> compile_command(ControllerCompiler const& compiler,
                                         ControllerSources const& sources);

/// What a compiler gets beside the environment of simulators. Its messages are English, for pages that look
/// for them.
std::vector<std::pair<std::string, std::string>> compile_variables(ControllerCompiler const& compiler);

} // namespace webots_cloud::core
