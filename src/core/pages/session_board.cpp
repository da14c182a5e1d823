#include "session_board.hpp"

#include "core/json_text.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace webots_cloud::core {
namespace {

// A snapshot must fit into a browser's queue (256 KiB) with room to spare: of many servers fewer and coarser
// points are sent.
constexpr std::size_t max_points = 20'000;
constexpr std::size_t max_precise_servers = 20;

double seconds(Duration duration)
{
    return std::chrono::duration<double>(duration).count();
}

void show(SessionRow& row, ServerLoad const& server)
{
    bool const is_up = server.state == ServerState::up;
    row.load = is_up ? std::optional(server.report.load) : std::nullopt;
    row.sessions = is_up ? server.report.sessions : std::nullopt;
    row.reported = is_up ? server.reported : TimePoint();
    row.problem = is_up ? std::string() : server.problem;
}

} // namespace

SessionRow session_row(ServerLoad const& server, std::uint64_t placed)
{
    SessionRow row;
    row.address = server.address;
    row.placed = placed;
    show(row, server);
    return row;
}

void SessionBoard::set_threshold(double threshold)
{
    must_restate_ = must_restate_ || threshold != threshold_;
    threshold_ = threshold;
}

void SessionBoard::list(std::vector<SessionRow> rows)
{
    auto const is_same = [](SessionRow const& left, Row const& right) {
        return left.address == right.shown.address;
    };
    must_restate_ =
        must_restate_ || !std::equal(rows.begin(), rows.end(), rows_.begin(), rows_.end(), is_same);
    places_.clear();
    rows_.clear();
    changed_.clear();
    told_.clear();
    std::vector<std::string> names;
    for (auto& row : rows) {
        names.push_back(row.address);
        rows_.push_back({std::move(row), false});
    }
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        places_.emplace(rows_[i].shown.address, i);
        change(i);
    }
    history_.set_series(names);
}

void SessionBoard::note(ServerLoad const& server)
{
    auto const place = places_.find(server.address);
    if (place == places_.end())
        return;
    auto& shown = rows_[place->second].shown;
    bool const is_still_down =
        server.state != ServerState::up && !shown.load && shown.problem == server.problem;
    if (is_still_down)
        return;
    show(shown, server);
    change(place->second);
}

void SessionBoard::count_placed(std::function<std::uint64_t(std::string_view address)> const& placed)
{
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        auto& shown = rows_[i].shown;
        auto const count = placed(shown.address);
        if (std::exchange(shown.placed, count) != count)
            change(i);
    }
}

void SessionBoard::change(std::size_t row)
{
    if (!std::exchange(rows_[row].is_changed, true))
        changed_.push_back(row);
}

void SessionBoard::take(TimePoint now, WallTime wall)
{
    now_ = now;
    wall_ = wall;
    restates_ = std::exchange(must_restate_, false);
    told_ = std::exchange(changed_, {});
    for (auto const row : told_)
        rows_[row].is_changed = false;
    has_new_point_ = add_point();
}

bool SessionBoard::add_point()
{
    if (!history_.is_due(now_))
        return false;
    std::vector<float> loads;
    loads.reserve(rows_.size());
    for (auto const& row : rows_)
        loads.push_back(
            static_cast<float>(row.shown.load.value_or(std::numeric_limits<double>::quiet_NaN())));
    history_.add(loads, now_);
    return true;
}

void SessionBoard::append_row(std::string& text, SessionRow const& row) const
{
    append_key(text, "load");
    append_number(text, row.load.value_or(std::numeric_limits<double>::quiet_NaN()), 2);
    append_key(text, "placed");
    append_number(text, static_cast<double>(row.placed), 0);
    if (row.load) {
        append_key(text, "age");
        append_number(text, seconds(std::max(now_ - row.reported, Duration::zero())), 1);
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
    std::size_t const each = rows_.empty() ? 0 : max_points / rows_.size();
    int const decimals = rows_.size() > max_precise_servers ? 0 : 1;
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
        append_quoted(text, rows_[i].shown.address);
        append_row(text, rows_[i].shown);
        append_key(text, "history");
        append_numbers(text, history_.line(i, each).values, decimals);
        text += '}';
    }
    return text + "]}";
}

std::string SessionBoard::update() const
{
    if (restates_)
        return snapshot();
    if (told_.empty() && !has_new_point_)
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
    for (std::size_t i = 0; i < told_.size(); ++i) {
        text += i == 0 ? "{" : ",{";
        append_key(text, "row");
        append_number(text, static_cast<double>(told_[i]), 0);
        append_row(text, rows_[told_[i]].shown);
        text += '}';
    }
    return text + "]}";
}

} // namespace webots_cloud::core
