#include "session_board.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"
#include "json_text.hpp"

#include <algorithm>
#include <cassert>
#include <limits>
#include <utility>

namespace webots_cloud::core {
namespace {

// A snapshot must fit into a browser's queue (256 KiB) with room to spare: of many servers fewer and coarser
// points are sent.
constexpr std::size_t max_points = 20'000;
constexpr std::size_t max_precise_servers = 20;

} // namespace

SessionRow session_row(ServerLoad const& server, std::uint64_t placed, std::string_view drained_by)
{
    bool const is_up = server.state == ServerState::up;
    SessionRow row;
    row.address = server.address;
    row.load = is_up ? std::optional(server.report.load) : std::nullopt;
    row.sessions = is_up ? server.report.sessions : std::nullopt;
    row.reported = is_up ? server.reported : TimePoint();
    row.problem = is_up ? std::string() : server.problem;
    row.placed = placed;
    row.drained_by = drained_by;
    if (drained_by.empty() && is_up && server.report.draining)
        row.drained_by = "machine";
    return row;
}

std::string waiting_text(WaitingFigures const& figures)
{
    auto const longest =
        figures.waiting == 0 ? std::string() : concat(" (longest ", age_text(figures.longest), ")");
    return concat("Waiting: ", std::to_string(figures.waiting), longest,
                  ", relayed: ", std::to_string(figures.relayed));
}

void SessionBoard::set_threshold(double threshold)
{
    must_restate_ = must_restate_ || threshold != threshold_;
    threshold_ = threshold;
}

void SessionBoard::list(std::span<ServerLoad const> servers, TextOf const& found_by, TextOf const& path_of)
{
    auto const told_by = [](TextOf const& text_of, std::string_view address) {
        return text_of ? text_of(address) : std::string_view();
    };
    auto const is_same = [&](ServerLoad const& left, Row const& right) {
        return left.address == right.address && told_by(found_by, left.address) == right.found_by &&
               told_by(path_of, left.address) == right.path;
    };
    must_restate_ =
        must_restate_ || !std::equal(servers.begin(), servers.end(), rows_.begin(), rows_.end(), is_same);
    positions_.clear();
    rows_.clear();
    changed_.clear();
    told_.clear();
    std::vector<std::string> names;
    for (auto const& server : servers) {
        names.push_back(server.address);
        rows_.push_back({server.address,
                         std::string(told_by(found_by, server.address)),
                         std::string(told_by(path_of, server.address)),
                         0,
                         {},
                         false});
    }
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        positions_.emplace(rows_[i].address, i);
        change_row(i);
    }
    history_.set_series(names);
}

void SessionBoard::change(std::string_view address)
{
    if (auto const position = positions_.find(address); position != positions_.end())
        change_row(position->second);
}

void SessionBoard::count_placed(std::function<std::uint64_t(std::string_view address)> const& placed)
{
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        auto const count = placed(rows_[i].address);
        if (std::exchange(rows_[i].placed, count) != count)
            change_row(i);
    }
}

void SessionBoard::note_drained(std::function<std::string_view(std::string_view address)> const& drained_by)
{
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        auto const by = drained_by(rows_[i].address);
        if (std::exchange(rows_[i].drained_by, by) != by)
            change_row(i);
    }
}

void SessionBoard::note_waiting(std::optional<WaitingFigures> figures)
{
    must_restate_ = must_restate_ || figures.has_value() != waiting_.has_value();
    if (figures) // as watchers are told: nothing changes in the middle of a second
        figures->longest = std::chrono::floor<std::chrono::seconds>(figures->longest);
    if (figures && waiting_)
        is_waiting_changed_ = is_waiting_changed_ || figures->waiting != waiting_->waiting ||
                              figures->longest != waiting_->longest || figures->relayed != waiting_->relayed;
    waiting_ = figures;
}

void SessionBoard::change_row(std::size_t row)
{
    if (!std::exchange(rows_[row].is_changed, true))
        changed_.push_back(row);
}

void SessionBoard::take(std::span<ServerLoad const> servers, TimePoint now, WallTime wall)
{
    assert(servers.size() == rows_.size());
    now_ = now;
    wall_ = wall;
    restates_ = std::exchange(must_restate_, false);
    told_ = std::exchange(changed_, {});
    for (auto const row : told_)
        rows_[row].is_changed = false;
    tells_waiting_ = std::exchange(is_waiting_changed_, false);
    has_new_point_ = add_point(servers);
}

bool SessionBoard::add_point(std::span<ServerLoad const> servers)
{
    if (!history_.is_due(now_))
        return false;
    std::vector<float> loads;
    loads.reserve(servers.size());
    for (auto const& server : servers)
        loads.push_back(server.state == ServerState::up ? static_cast<float>(server.report.load)
                                                        : std::numeric_limits<float>::quiet_NaN());
    history_.add(loads, now_);
    return true;
}

void SessionBoard::append_waiting(std::string& text) const
{
    append_key(text, "waiting");
    append_number(text, static_cast<double>(waiting_->waiting), 0);
    append_key(text, "longestWait");
    append_number(text, as_seconds(waiting_->longest), 0);
    append_key(text, "relayed");
    append_number(text, static_cast<double>(waiting_->relayed), 0);
}

void SessionBoard::append_row(std::string& text, SessionRow const& row) const
{
    append_key(text, "load");
    append_number(text, row.load.value_or(std::numeric_limits<double>::quiet_NaN()), 2);
    append_key(text, "placed");
    append_number(text, static_cast<double>(row.placed), 0);
    if (row.load) {
        append_key(text, "age");
        append_number(text, as_seconds(std::max(now_ - row.reported, Duration::zero())), 1);
    }
    if (row.sessions) {
        append_key(text, "sessions");
        append_number(text, *row.sessions, 0);
    }
    if (!row.drained_by.empty()) {
        append_key(text, "drained");
        append_quoted(text, row.drained_by);
    }
    if (!row.problem.empty()) {
        append_key(text, "problem");
        append_quoted(text, row.problem);
    }
}

std::string SessionBoard::snapshot(std::span<ServerLoad const> servers) const
{
    std::size_t const each = rows_.empty() ? 0 : max_points / rows_.size();
    int const decimals = rows_.size() > max_precise_servers ? 0 : 1;
    std::string text = "{";
    append_key(text, "now");
    append_number(text, as_seconds(wall_.time_since_epoch()), 3);
    append_key(text, "threshold");
    append_number(text, threshold_, 2);
    append_key(text, "last");
    append_number(text, as_seconds(now_ - history_.last()), 3);
    append_key(text, "spacing");
    append_number(text, rows_.empty() ? 0 : as_seconds(history_.line(0, each).spacing), 3);
    if (waiting_)
        append_waiting(text);
    append_key(text, "servers");
    text += '[';
    for (std::size_t i = 0; i < rows_.size(); ++i) {
        text += i == 0 ? "{" : ",{";
        append_key(text, "address");
        append_quoted(text, rows_[i].address);
        if (!rows_[i].found_by.empty()) {
            append_key(text, "foundBy");
            append_quoted(text, rows_[i].found_by);
        }
        if (!rows_[i].path.empty()) {
            append_key(text, "path");
            append_quoted(text, rows_[i].path);
        }
        append_row(text, session_row(servers[i], rows_[i].placed, rows_[i].drained_by));
        append_key(text, "history");
        append_numbers(text, history_.line(i, each).values, decimals);
        text += '}';
    }
    return text + "]}";
}

std::string SessionBoard::update(std::span<ServerLoad const> servers) const
{
    if (restates_)
        return snapshot(servers);
    if (told_.empty() && !has_new_point_ && !tells_waiting_)
        return {};
    std::string text = "{";
    append_key(text, "now");
    append_number(text, as_seconds(wall_.time_since_epoch()), 3);
    if (has_new_point_) {
        append_key(text, "point");
        text += "true";
    }
    if (waiting_ && tells_waiting_)
        append_waiting(text);
    append_key(text, "rows");
    text += '[';
    for (std::size_t i = 0; i < told_.size(); ++i) {
        text += i == 0 ? "{" : ",{";
        append_key(text, "row");
        append_number(text, static_cast<double>(told_[i]), 0);
        auto const& told = rows_[told_[i]];
        append_row(text, session_row(servers[told_[i]], told.placed, told.drained_by));
        text += '}';
    }
    return text + "]}";
}

} // namespace webots_cloud::core
