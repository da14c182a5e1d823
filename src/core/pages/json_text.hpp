// JSON of many numbers, for the monitor pages.
//
// Everything else leaves JSON to Boost.JSON, which also quotes the strings here. But it gives each number an
// exponent (`7.9E0`) and needs a tree of values: a snapshot of the simulation server's board takes 31 kB and
// 340 us as text, 45 kB and 366 us through Boost.JSON; an update of 1,000 rows 63 kB and 384 us, or 67 kB
// and 470 us. A snapshot must fit into a browser's queue, and is sent to each browser that comes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Appends a number with at most this many decimals and no superfluous zeros; `null` for what is not finite.
void append_number(std::string& text, double value, int decimals);

/// Appends a string in quotes, escaped.
void append_quoted(std::string& text, std::string_view value);

/// Appends `"key":`, after a comma where the object has a member already.
void append_key(std::string& text, std::string_view key);

/// Appends an array of numbers.
void append_numbers(std::string& text, std::vector<float> const& values, int decimals);

} // namespace webots_cloud::core
