#pragma once

#include <string_view>

namespace webots_cloud::demo {

/// Writes `line` and a newline to stdout at once: whoever supervises the simulator reads line by line.
/// Waits while the reader is slow. A reader that is gone is not an error.
void print_line(std::string_view line);

/// Writes exactly these bytes.
void print_bytes(std::string_view bytes);

} // namespace webots_cloud::demo
