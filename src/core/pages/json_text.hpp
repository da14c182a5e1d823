// JSON written straight into a string: for messages of many numbers, where a tree of values would cost more
// than the text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Appends a number with at most so many decimals and no superfluous zeros; `null` for what is not finite.
void append_number(std::string& text, double value, int decimals);

/// Appends a string in quotes, escaped.
void append_quoted(std::string& text, std::string_view value);

/// Appends `"key":`, after a comma where the object has a member already.
void append_key(std::string& text, std::string_view key);

/// Appends an array of numbers.
void append_numbers(std::string& text, std::vector<float> const& values, int decimals);

} // namespace webots_cloud::core
