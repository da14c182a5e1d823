// Keeps the texts of the session server's monitor page, and remembers which have changed, so that each of
// many watchers is sent the same few bytes. Who sends them, and when, is the service's business.
#include "session_board.hpp"

#include "core/time_text.hpp"
#include "json_text.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace webots_cloud::core {
namespace {

// A snapshot must fit into a browser's queue (256 KiB) with room to spare: of many servers fewer and coarser
// points are sent.
constexpr std::size_t max_points = 20'000;
constexpr std::size_t max_precise_servers = 20;

constexpr float unknown_figure = std::numeric_limits<float>::quiet_NaN();

/// What is kept for a day: the mean load of machines that are up, their seats, those that are taken, and who
/// waits.
constexpr std::array<std::string_view, 4> day_figures = {"load", "taken", "seats", "waiting"};

} // namespace

SessionBoard::SessionBoard(Duration step, double threshold)
    : history_(step), day_(day_figures), threshold_(threshold)
{}

SessionRow session_row(ServerLoad const& server, std::uint64_t placed, std::string_view drained_by)
{
    bool const is_up = server.state == ServerState::up;
    SessionRow row;
    row.address = server.address;
    row.load = is_up ? std::optional(server.report.load) : std::nullopt;
    row.sessions = is_up ? server.report.sessions : std::nullopt;
    row.seats = is_up ? server.report.capacity : std::nullopt;
    row.reported = is_up ? server.reported : TimePoint();
    row.problem = is_up ? std::string() : server.problem;
    row.placed = placed;
    row.drained_by = drained_by;
    if (drained_by.empty() && is_up && server.report.draining)
        row.drained_by = "machine";
    return row;
}

void SessionBoard::set_threshold(double threshold)
{
    must_restate_ = must_restate_ || threshold != threshold_;
    threshold_ = threshold;
}

void SessionBoard::put(ServerLoad const& server, FleetMachine const& machine, FleetMachine const* was,
                       std::optional<std::string_view> before)
{
    auto const next = before ? by_address_.find(*before) : by_address_.end();
    auto const place = next == by_address_.end() ? rows_.end() : next->second;
    auto const [known, is_new] = by_address_.try_emplace(server.address);
    if (is_new) {
        known->second = rows_.emplace(place);
        known->second->server = &server;
        known->second->machine = &machine;
        known->second->history = history_.series();
    }
    auto& row = *known->second;
    bool const moves = before && place != known->second && place != std::next(known->second);
    if (moves)
        rows_.splice(place, rows_, known->second);
    bool const is_another = was && (was->spec.found_by != machine.spec.found_by || was->path != machine.path);
    must_restate_ = must_restate_ || is_new || moves || is_another;
    change_row(row);
}

void SessionBoard::remove(std::string_view address)
{
    auto const found = by_address_.find(address);
    if (found == by_address_.end())
        return;
    auto const row = found->second;
    if (row->is_changed)
        std::erase(changed_, &*row);
    told_.clear(); // everything is told next
    must_restate_ = true;
    by_address_.erase(found);
    rows_.erase(row);
}

SessionBoard::Row* SessionBoard::find(std::string_view address)
{
    auto const found = by_address_.find(address);
    return found == by_address_.end() ? nullptr : &*found->second;
}

void SessionBoard::change(std::string_view address)
{
    if (auto* const row = find(address))
        change_row(*row);
}

void SessionBoard::count_placed(std::function<std::uint64_t(std::string_view address)> const& placed)
{
    for (auto& row : rows_) {
        auto const count = placed(row.server->address);
        if (std::exchange(row.placed, count) != count)
            change_row(row);
    }
}

void SessionBoard::note_states(std::function<SiteState(ServerLoad const& server)> const& state)
{
    for (auto& row : rows_) {
        auto const now = state(*row.server);
        if (std::exchange(row.state, now) != now)
            change_row(row);
    }
}

void SessionBoard::note_refusals(std::function<std::string_view(std::string_view address)> const& refusal)
{
    for (auto& row : rows_) {
        auto const now = refusal(row.server->address);
        if (row.refusal == now)
            continue;
        row.refusal = now;
        change_row(row);
    }
}

void SessionBoard::note_site(SiteState state)
{
    is_site_changed_ = is_site_changed_ || site_ != state;
    site_ = state;
}

void SessionBoard::note_waiting(std::optional<WaitingFigures> figures)
{
    must_restate_ = must_restate_ || figures.has_value() != waiting_.has_value();
    if (figures) // as watchers are told: nothing changes in the middle of a second
        figures->longest = std::chrono::floor<std::chrono::seconds>(figures->longest);
    if (figures && waiting_)
        is_waiting_changed_ = is_waiting_changed_ || *figures != *waiting_;
    waiting_ = std::move(figures);
}

void SessionBoard::change_row(Row& row)
{
    if (!std::exchange(row.is_changed, true))
        changed_.push_back(&row);
}

void SessionBoard::take(TimePoint now, WallTime wall)
{
    now_ = now;
    wall_ = wall;
    restates_ = std::exchange(must_restate_, false);
    told_ = std::exchange(changed_, {});
    for (auto* const row : told_)
        row->is_changed = false;
    tells_waiting_ = std::exchange(is_waiting_changed_, false);
    tells_site_ = std::exchange(is_site_changed_, false);
    has_new_point_ = add_point();
    has_new_minute_ = add_minute();
}

bool SessionBoard::add_point()
{
    if (!history_.is_due(now_))
        return false;
    for (auto& row : rows_)
        history_.set_next(row.history, row.server->state == ServerState::up
                                           ? static_cast<float>(row.server->report.load)
                                           : unknown_figure);
    history_.advance(now_);
    return true;
}

bool SessionBoard::add_minute()
{
    if (!day_.is_due(now_))
        return false;
    double load = 0;
    double taken = 0;
    double seats = 0;
    int up = 0;
    for (auto const& row : rows_) {
        if (row.server->state != ServerState::up)
            continue;
        ++up;
        load += row.server->report.load;
        taken += row.server->report.sessions.value_or(0);
        seats += row.server->report.capacity.value_or(0);
    }
    auto const waiting = waiting_ ? static_cast<float>(waiting_->waiting) : unknown_figure;
    auto const mean = up == 0 ? unknown_figure : static_cast<float>(load / up);
    day_.add(std::array{mean, static_cast<float>(taken), static_cast<float>(seats), waiting});
    return day_.advance(now_);
}

void SessionBoard::append_waiting(std::string& text) const
{
    append_key(text, "waiting");
    append_number(text, static_cast<double>(waiting_->waiting), 0);
    append_key(text, "longestWait");
    append_number(text, as_seconds(waiting_->longest), 0);
    append_key(text, "relayed");
    append_number(text, static_cast<double>(waiting_->relayed), 0);
    if (waiting_->waiting == 0)
        return;
    append_key(text, "waitingFor");
    text += '{';
    for (auto const& [why, count] : waiting_->reasons) {
        append_key(text, why);
        append_number(text, static_cast<double>(count), 0);
    }
    text += '}';
}

void SessionBoard::append_site(std::string& text) const
{
    append_key(text, "state");
    append_quoted(text, word_of(*site_));
    append_key(text, "stateText");
    append_quoted(text, sentence_of(*site_));
}

SessionRow SessionBoard::shown(Row const& row) const
{
    auto shown = session_row(*row.server, row.placed, row.machine->drained_by());
    shown.state = row.state;
    shown.refusal = row.refusal;
    return shown;
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
    if (row.seats) {
        append_key(text, "seats");
        append_number(text, *row.seats, 0);
    }
    if (row.state) {
        append_key(text, "state");
        append_quoted(text, word_of(*row.state));
    }
    if (!row.drained_by.empty()) {
        append_key(text, "drained");
        append_quoted(text, row.drained_by);
    }
    if (!row.refusal.empty()) {
        append_key(text, "refusal");
        append_quoted(text, row.refusal);
    }
    if (!row.problem.empty()) {
        append_key(text, "problem");
        append_quoted(text, row.problem);
    }
}

std::string SessionBoard::snapshot()
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
    append_number(text, rows_.empty() ? 0 : as_seconds(history_.spacing(each)), 3);
    if (!about_.empty()) {
        append_key(text, "about");
        text += about_;
    }
    if (site_)
        append_site(text);
    if (waiting_)
        append_waiting(text);
    day_.append_to(text, now_);
    append_key(text, "servers");
    text += '[';
    char const* separator = "{";
    std::size_t number = 0;
    for (auto& row : rows_) {
        row.number = number++;
        text += std::exchange(separator, ",{");
        append_key(text, "address");
        append_quoted(text, row.server->address);
        if (auto const& found_by = row.machine->spec.found_by; !found_by.empty()) {
            append_key(text, "foundBy");
            append_quoted(text, found_by);
        }
        if (!row.machine->path.empty()) {
            append_key(text, "path");
            append_quoted(text, row.machine->path);
        }
        append_row(text, shown(row));
        append_key(text, "history");
        append_numbers(text, history_.line(row.history, each).values, decimals);
        text += '}';
    }
    return text + "]}";
}

std::string SessionBoard::update()
{
    if (restates_)
        return snapshot();
    if (told_.empty() && !has_new_point_ && !has_new_minute_ && !tells_waiting_ && !tells_site_)
        return {};
    std::string text = "{";
    append_key(text, "now");
    append_number(text, as_seconds(wall_.time_since_epoch()), 3);
    if (has_new_point_) {
        append_key(text, "point");
        text += "true";
    }
    if (has_new_minute_)
        day_.append_point_to(text);
    if (site_ && tells_site_)
        append_site(text);
    if (waiting_ && tells_waiting_)
        append_waiting(text);
    append_key(text, "rows");
    text += '[';
    char const* separator = "{";
    for (auto const* const told : told_) {
        text += std::exchange(separator, ",{");
        append_key(text, "row");
        append_number(text, static_cast<double>(told->number), 0);
        append_row(text, shown(*told));
        text += '}';
    }
    return text + "]}";
}

} // namespace webots_cloud::core
