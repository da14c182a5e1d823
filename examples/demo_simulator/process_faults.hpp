#pragma once

#include "faults.hpp"

#include <string_view>

/// The faults that concern the process rather than the protocol.
namespace webots_cloud::demo {

/// Forks the grandchildren that were asked for and changes the reaction to SIGTERM. Call it before any
/// thread or io_context exists.
void apply_process_faults(Faults const& faults);

/// Writes the unusual lines that were asked for.
void print_unusual_lines(Faults const& faults);

/// Writes some 64 KiB of lines.
void print_flood();

/// By SIGSEGV. `why`: a line for stderr, if there is anything to say.
[[noreturn]] void crash(std::string_view why = {});
[[noreturn]] void hang();

/// Ends the process; with the fault no_final_newline in the middle of a line.
[[noreturn]] void leave(Faults const& faults, int status);

} // namespace webots_cloud::demo
