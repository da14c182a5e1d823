#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace webots_cloud::demo {

/// `text` as one line of valid UTF-8: malformed bytes and control characters become '?', and at most
/// `limit` bytes are kept. Everything that comes from a world file or a client passes here before it
/// goes into a WebSocket text frame or a picture, both of which refuse malformed UTF-8.
std::string printable(std::string_view text, std::size_t limit = 200);

/// Well-formed, whatever characters it holds.
bool is_utf8(std::string_view text);

/// `text` with the five XML special characters escaped.
std::string xml_escaped(std::string_view text);

/// `value` with at most six significant digits and no locale, as Webots writes VRML numbers.
std::string number_text(double value);

} // namespace webots_cloud::demo
