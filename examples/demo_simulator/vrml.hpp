#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

/// A reader of the VRML text that Webots worlds are written in. It knows the grammar and no node types.
namespace webots_cloud::demo::vrml {

struct Node;

/// The value of one field, sorted by kind: `1 2 3` fills `numbers`; strings, `TRUE` and `FALSE` fill
/// `words`; nodes fill `nodes`. `USE` and `IS` references are read and dropped.
struct Value
{
    std::vector<double> numbers;
    std::vector<std::string> words;
    std::vector<Node> nodes;
};

struct Node
{
    std::string type;
    std::map<std::string, Value, std::less<>> fields;

    /// The field `name`, or an empty value.
    Value const& field(std::string_view name) const;
};

struct Document
{
    std::string version; ///< "R2025a" from the line `#VRML_SIM R2025a utf8`, or empty
    std::vector<Node> nodes;
    std::string problem; ///< why reading stopped early ("line 7: ..."), or empty
};

/// Reads any bytes, never throws on their account. What was complete before a problem is kept.
Document read(std::string_view text);

inline constexpr std::size_t deepest_nesting = 64;
inline constexpr std::size_t max_values = 200'000; ///< numbers, words and nodes of a whole document

} // namespace webots_cloud::demo::vrml
