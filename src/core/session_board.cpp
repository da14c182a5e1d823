#include "session_board.hpp"

#include "json_text.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace webots_cloud::core {
namespace {

// A snapshot must fit into a browser's queue (256 KiB) with room to spare: of many servers fewer and coarser
// points are sent.
constexpr std::size_t most_points = 20'000;
constexpr std::size_t most_precise_servers = 20;

double seconds(Duration duration)
{
    return std::chrono::duration<double>(duration).count();
}

} // namespace

std::vector<SessionRow> session_rows(std::vector<ServerLoad> servers,
                                     std::function<std::uint64_t(std::string_view)> const& placed)
{
    std::vector<SessionRow> rows;
    rows.reserve(servers.size());
    for (auto& server : servers) {
        auto& row = rows.emplace_back();
        row.placed = placed(server.address);
        row.address = std::move(server.address);
        if (server.state == ServerState::up) {
            row.load = server.report.load;
            row.sessions = server.report.sessions;
            row.reported = server.reported;
        } else {
            row.problem = std::move(server.problem);
        }
    }
    return rows;
}

void SessionBoard::set_threshold(double threshold)
{
    must_restate_ = must_restate_ || threshold != threshold_;
    threshold_ = threshold;
}

void SessionBoard::take(std::vector<SessionRow> rows, TimePoint now, WallTime wall)
{
    now_ = now;
    wall_ = wall;
    changed_.clear();
    relisted_ =
        std::exchange(must_restate_, false) ||
        !std::equal(rows.begin(), rows.end(), rows_.begin(), rows_.end(),
                    [](auto const& left, auto const& right) { return left.address == right.address; });
    for (std::size_t i = 0; !relisted_ && i < rows.size(); ++i)
        if (!(rows[i] == rows_[i]))
            changed_.push_back(i);
    rows_ = std::move(rows);
    has_new_point_ = add_point();
}

bool SessionBoard::add_point()
{
    if (relisted_) {
        std::vector<std::string> names;
        for (auto const& row : rows_)
            names.push_back(row.address);
        history_.set_series(names);
    }
    if (!history_.is_due(now_))
        return false;
    std::vector<float> loads;
    for (auto const& row : rows_)
        loads.push_back(row.load ? static_cast<float>(*row.load) : std::numeric_limits<float>::quiet_NaN());
    history_.add(loads, now_);
    return true;
}

void SessionBoard::append_row(std::string& text, std::size_t index) const
{
    auto const& row = rows_[index];
    append_key(text, "load");
    append_number(text, row.load.value_or(std::numeric_limits<double>::quiet_NaN()), 2);
    append_key(text, "placed");
    append_number(text, static_cast<double>(row.placed), 0);
    if (row.load) {
        append_key(text, "age");
        append_number(text, seconds(now_ - row.reported), 1);
    }
    if (row.sessions) {
        append_key(text, "sessions");
        append_number(text, *row.sessions, 0);
    }
    if (!row.problem.empty()) {
        append_key(text, "problem");
        append_quoted(text, row.problem);
    }
}

std::string SessionBoard::snapshot() const
{
    std::size_t const each = rows_.empty() ? 0 : most_points / rows_.size();
    int const decimals = rows_.size() > most_precise_servers ? 0 : 1;
    std::string text = "{";
    append_key(text, "now");
    append_number(text, seconds(wall_.time_since_epoch()), 3);
    append_key(text, "threshold");
    append_number(text, threshold_, 2);
    append_key(text, "last");
    append_number(text, seconds(now_ - history_.last()), 3);
    append_key(text, "spacing");
    append_number(text, rows_.empty() ? 0 : seconds(history_.line(0, each).spacing), 3);
    append_key(text, "servers");
    text += '[';
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        text += i == 0 ? "{" : ",{";
        append_key(text, "address");
        append_quoted(text, rows_[i].address);
        append_row(text, i);
        append_key(text, "history");
        append_numbers(text, history_.line(i, each).values, decimals);
        text += '}';
    }
    return text + "]}";
}

std::string SessionBoard::update() const
{
    if (relisted_)
        return snapshot();
    if (changed_.empty() && !has_new_point_)
        return {};
    std::string text = "{";
    append_key(text, "now");
    append_number(text, seconds(wall_.time_since_epoch()), 3);
    if (has_new_point_) {
        append_key(text, "point");
        text += "true";
    }
    append_key(text, "rows");
    text += '[';
    for (std::size_t i = 0; i < changed_.size(); ++i) {
        text += i == 0 ? "{" : ",{";
        append_key(text, "row");
        append_number(text, static_cast<double>(changed_[i]), 0);
        append_row(text, changed_[i]);
        text += '}';
    }
    return text + "]}";
}

} // namespace webots_cloud::core
