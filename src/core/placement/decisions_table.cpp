#include "decisions_table.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <vector>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

constexpr std::size_t columns = 5;
constexpr std::size_t longest = 200; // of a name
using Row = std::array<std::string, columns>;

json::value const* member(json::object const& object, std::string_view name)
{
    return object.if_contains(name);
}

double number_of(json::object const& object, std::string_view name)
{
    auto const* const value = member(object, name);
    boost::system::error_code error;
    auto const number = value && value->is_number() ? value->to_number<double>(error) : 0;
    return error ? 0 : number;
}

std::string text_of(json::object const& object, std::string_view name)
{
    auto const* const value = member(object, name);
    return value && value->is_string() ? printable(value->get_string(), longest) : std::string();
}

std::string whole(double number)
{
    return std::to_string(std::llround(std::clamp(number, -1e15, 1e15)));
}

std::string age_of(json::object const& decision)
{
    constexpr double most = 1e9; // seconds
    auto const age = std::chrono::duration<double>(std::clamp(number_of(decision, "secondsAgo"), 0.0, most));
    return age_text(std::chrono::duration_cast<Duration>(age));
}

/// Why machines did not come into question, as in "full 2, load 1".
std::string reasons_of(json::object const& decision)
{
    std::string reasons;
    auto const* const refused = member(decision, "refused");
    if (refused && refused->is_object())
        for (auto const& [reason, count] : refused->get_object())
            reasons += concat(reasons.empty() ? "" : ", ", printable(std::string_view(reason), longest), " ",
                              count.is_number() ? whole(number_of(refused->get_object(), reason)) : "");
    if (auto const held = number_of(decision, "held"); held > 0)
        reasons += concat(reasons.empty() ? "" : ", ", whole(held), " of ",
                          whole(number_of(decision, "freeSeats")), " free seats held for others");
    return reasons;
}

std::string load_of(json::object const& decision, std::string_view chosen)
{
    auto const* const machines = member(decision, "machines");
    if (machines && machines->is_array())
        for (auto const& machine : machines->get_array())
            if (machine.is_object() && text_of(machine.get_object(), "server") == chosen)
                return concat(whole(number_of(machine.get_object(), "load")), "%");
    return {};
}

std::vector<Row> rows_of(json::array const& decisions)
{
    std::vector<Row> rows{{"WHEN", "SENT TO", "ITS LOAD", "OFFERED", "NOT OFFERED"}};
    std::size_t times = 1; // of the last row
    for (auto const& each : decisions) {
        if (!each.is_object())
            continue;
        auto const& decision = each.get_object();
        auto const chosen = text_of(decision, "chosen");
        Row row{concat(age_of(decision), " ago"), chosen.empty() ? std::string("nobody") : chosen,
                chosen.empty() ? std::string() : load_of(decision, chosen),
                whole(number_of(decision, "offered")), reasons_of(decision)};
        auto& last = rows.back();
        bool const is_again =
            chosen.empty() && last[1].starts_with("nobody") && last[3] == row[3] && last[4] == row[4];
        times = is_again ? times + 1 : 1;
        if (is_again)
            last[1] = concat("nobody, ", std::to_string(times), " times");
        else
            rows.push_back(std::move(row));
    }
    return rows;
}

} // namespace

std::string decisions_table(std::string_view text)
{
    boost::system::error_code failed;
    auto const answer = json::parse(text, failed);
    auto const* const all = failed ? nullptr : answer.if_object();
    auto const* const list = all ? member(*all, "decisions") : nullptr;
    if (!list || !list->is_array())
        return std::string(text);
    if (list->get_array().empty())
        return "Nobody has asked for a simulation yet.";
    auto const rows = rows_of(list->get_array());
    std::array<std::size_t, columns> widths{};
    for (auto const& row : rows)
        for (std::size_t i = 0; i < columns; ++i)
            widths[i] = std::max(widths[i], row[i].size());
    std::string table;
    for (auto const& row : rows) {
        std::string line;
        for (std::size_t i = 0; i < columns; ++i)
            line += concat(row[i], std::string(widths[i] - row[i].size() + 2, ' '));
        line.erase(line.find_last_not_of(' ') + 1);
        table += concat(line, "\n");
    }
    return concat(table, "--decisions --json has all figures.");
}

} // namespace webots_cloud::core
