// The command line of the guard, and the text that explains it. What belongs to one part of the guard, such
// as limits and users, is read there.
#pragma once

#include "pid_namespace.hpp"

#include <cstdio>

namespace webots_cloud::guard {

/// Takes `--cleanup` and its command line out of ours, so that `argv` begins with the next argument. Null:
/// there is none.
char** take_cleanup_command(int& argc, char**& argv);

/// Takes an option out of our command line.   Returns: whether it was there.
bool take_option(int& argc, char**& argv, char const* option);

/// Takes what is said of the program, in the order of the usage. `argv` begins with GRACE_MS afterwards.
/// Returns: false when it is malformed.
bool take_program(int& argc, char**& argv, Program& program);

/// Prints the usage text.
void explain(std::FILE* file);

/// Says that the arguments are not understood.   Returns: the exit status.
int refuse_arguments();

} // namespace webots_cloud::guard
