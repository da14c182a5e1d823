// Reads JSON that people have written: knows where everything stands, and goes on after a mistake, so that
// all of them can be told at once.
#pragma once

#include <boost/json/value.hpp>

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Where a value stands, and what is in it. All are offsets into the text.
struct JsonPlace
{
    JsonPlace() = default;

    std::size_t key = 0; ///< Of a member: its name.
    std::size_t value = 0;
    std::map<std::string, JsonPlace, std::less<>> members; ///< Of an object; of two with one name the last.
    std::vector<JsonPlace> entries;                        ///< Of a list.
};

/// A sentence about what begins at an offset.
struct JsonRemark
{
    JsonRemark() = default;
    JsonRemark(std::size_t offset, std::string text) : offset(offset), text(std::move(text)) {}

    std::size_t offset = 0;
    std::string text;
    /// There is a number with a unit, which is read as a string: whoever knows the key knows what to write.
    bool is_quantity = false;
};

struct PositionedJson
{
    PositionedJson() = default;

    boost::json::value value; ///< As far as it can be understood; null where it can't.
    JsonPlace place;
    std::vector<JsonRemark> faults;     ///< Empty: `text` is JSON. In the order of the text.
    std::vector<JsonRemark> duplicates; ///< Keys that an object has twice; the last one counts.
    bool is_complete = true;            ///< Nothing was left out at the end because of a fault.
};

/// Reads a text of any bytes. What has no fault is exactly what Boost.JSON takes, which reads the single
/// strings and numbers.
PositionedJson read_positioned_json(std::string_view text);

/// Finds lines and columns in a text, which has to outlive it; quickly where offsets grow.
class TextPlaces
{
public:
    explicit TextPlaces(std::string_view text) : text_(text) {}

    /// "3:7": line and column of an offset, both from 1; the column in characters.
    std::string at(std::size_t offset);

private:
    std::string_view text_;
    std::size_t offset_ = 0;
    std::size_t line_ = 1;
    std::size_t column_ = 1;
};

/// The same of one offset.
std::string line_and_column(std::string_view text, std::size_t offset);

} // namespace webots_cloud::core
