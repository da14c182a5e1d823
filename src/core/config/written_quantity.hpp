// Numbers as people write them into configurations: "2h", "4 GB", "50%". A configuration has plain numbers,
// in the unit of their key; here is found out which one was meant.
#pragma once

#include "config_keys.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Whether a text is a number with a unit, or several: `2h`, `1h 30min`, `4 GB`, `10 MB/s`.
bool is_quantity(std::string_view text);

/// The number that a text means where `key` counts in a unit of its own: of "2h" 7200 for seconds. A number
/// without a unit is in that of the key. Nothing: it means none, or none that the key may have.
std::optional<double> number_meant(std::string_view text, ConfigKey const& key);

/// How a number stands in the file.
enum class Quotes
{
    none,
    around
};

/// What to write instead of such a text, as the end of a sentence; nothing where it means no number.
std::string number_advice(std::string_view text, ConfigKey const& key, Quotes quotes);

} // namespace webots_cloud::core
