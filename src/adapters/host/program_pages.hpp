// Memory that holds a program's code and constants.
#pragma once

namespace webots_cloud::adapters {

/// Gives the pages of code and constants, of this program and its libraries, back to the kernel: those that
/// only the start needed take no memory then. The others come back when they are used, from the page cache
/// (about a microsecond for 64 kB) or, where that had to go, from the disk. To be called once, when a server
/// has started.
///
/// Thread-safety: any thread.
void release_program_pages() noexcept;

} // namespace webots_cloud::adapters
