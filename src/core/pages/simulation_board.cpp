// Writes the JSON of the page: what never changes, what changes each second, and the lines of its charts.
#include "simulation_board.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"
#include "json_text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::size_t max_line_points = 600;
constexpr std::size_t world_bytes = 200;

void append_row(std::string& text, SimulationRow const& row)
{
    text += text.back() == '[' ? "{" : ",{";
    append_key(text, "id");
    append_number(text, static_cast<double>(row.id), 0);
    append_key(text, "world");
    append_quoted(text, row.world);
    append_key(text, "state");
    append_quoted(text, row.state);
    append_key(text, "age");
    append_number(text, as_seconds(row.age), 0);
    if (!row.log.empty()) {
        append_key(text, "log");
        append_quoted(text, row.log);
    }
    if (row.process != 0) {
        append_key(text, "process");
        append_number(text, row.process, 0);
    }
    if (row.cpu) {
        append_key(text, "cpu");
        append_number(text, *row.cpu, 1);
    }
    if (row.graphics > 0) {
        append_key(text, "graphics");
        append_number(text, row.graphics, 1);
    }
    if (row.memory) {
        append_key(text, "memory");
        append_number(text, *row.memory, 1);
    }
    if (row.processes) {
        append_key(text, "processes");
        append_number(text, static_cast<double>(*row.processes), 0);
    }
    if (row.more) {
        append_key(text, "more");
        append_number(text, 1, 0);
    }
    text += '}';
}

} // namespace

double process_cpu_percent(Duration used_before, Duration used_after, Duration between) noexcept
{
    if (used_after <= used_before || between <= Duration::zero())
        return 0;
    return 100 * as_seconds(used_after - used_before) / as_seconds(between);
}

std::size_t staged(std::vector<SimulationRow> const& rows)
{
    return static_cast<std::size_t>(std::ranges::count_if(rows, &SimulationRow::staged));
}

std::string short_world(std::string_view url)
{
    constexpr std::size_t max = 1024;
    auto text = printable(url.size() > max ? url.substr(url.size() - max) : url, 4 * max);
    if (text.size() > world_bytes) {
        auto from = text.size() - world_bytes + 3;
        while (from < text.size() && (static_cast<unsigned char>(text[from]) & 0xc0) == 0x80)
            ++from; // not from within a character
        text = concat("\u2026", std::string_view(text).substr(from));
    }
    return text;
}

SimulationBoard::SimulationBoard() : history_(std::chrono::seconds(1))
{
    series_.fill(history_.series());
}

void SimulationBoard::take(MonitorSample const& sample, double load, TimePoint now, WallTime wall)
{
    sample_ = sample;
    load_ = load;
    now_ = now;
    wall_ = wall;
    auto const values = sample.values();
    for (std::size_t i = 0; i < series_.size(); ++i)
        history_.set_next(series_[i], values[i]);
    history_.advance(now);
    day_.add(values);
    has_new_minute_ = day_.advance(now);
}

std::string SimulationBoard::begin(std::vector<SimulationRow> const& rows,
                                   std::vector<MachineFigure> const& machine, bool is_draining) const
{
    std::string text = "{";
    append_key(text, "now");
    append_number(text, as_seconds(wall_.time_since_epoch()), 3);
    append_key(text, "load");
    append_number(text, load_, 2);
    append_key(text, "count");
    append_number(text, static_cast<double>(rows.size()), 0);
    for (auto const& [name, value, decimals] : machine) {
        append_key(text, name);
        append_number(text, value, decimals);
    }
    if (auto const count = staged(rows); count > 0) {
        append_key(text, "staged");
        append_number(text, static_cast<double>(count), 0);
    }
    if (is_draining) {
        append_key(text, "draining");
        text += "true";
    }
    append_key(text, "simulations");
    text += '[';
    for (std::size_t i = 0; i < std::min(rows.size(), max_rows); ++i)
        append_row(text, rows[i]);
    return text + ']';
}

std::string SimulationBoard::update(std::vector<SimulationRow> const& rows,
                                    std::vector<MachineFigure> const& machine, bool is_draining) const
{
    auto text = begin(rows, machine, is_draining);
    append_key(text, "point");
    append_numbers(text, sample_.values(), 3);
    if (has_new_minute_)
        day_.append_point_to(text);
    return text + '}';
}

std::string SimulationBoard::snapshot(std::vector<SimulationRow> const& rows,
                                      std::vector<MachineFigure> const& machine, bool is_draining) const
{
    auto text = begin(rows, machine, is_draining);
    if (!about_.empty()) {
        append_key(text, "about");
        text += about_;
    }
    day_.append_to(text, now_);
    append_key(text, "spacing");
    append_number(text, as_seconds(history_.spacing(max_line_points)), 3);
    append_key(text, "series");
    text += '[';
    // The columns of MonitorSample: two counts, seven percentages, two rates.
    auto const decimals = [](std::size_t column) { return column < 2 ? 0 : column < 9 ? 1 : 3; };
    for (std::size_t i = 0; i < MonitorSample::columns; ++i) {
        text += i == 0 ? "{" : ",{";
        append_key(text, "name");
        append_quoted(text, MonitorSample::names()[i]);
        append_key(text, "history");
        append_numbers(text, history_.line(series_[i], max_line_points).values, decimals(i));
        text += '}';
    }
    return text + "]}";
}

} // namespace webots_cloud::core
