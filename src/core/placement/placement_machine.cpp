// Reconciles two truths about a machine: what we placed there and what it reports, seconds later. A placement
// counts as a reservation until a report includes it or it runs out; what a session costs is learned from how
// reports change. The model and its figures are in docs/scheduling.md.
#include "placement_machine.hpp"

#include <algorithm>
#include <cmath>

namespace webots_cloud::placement {

namespace {

using std::chrono::seconds;

/// A report is the mean of five samples, one a second: for this long it shows new sessions only in part.
constexpr Duration averaging = seconds(6);
/// The part of an unexplained difference that one report moves the level by.
constexpr double gain = 0.3;
/// How much evidence outweighs the assumed need of memory, in sessions² s.
constexpr double memory_strength = 60;
/// For so long, twice the time constant of the high-pass filters, a departure explains a falling load.
constexpr Duration departure_memory = seconds(240);
/// In eighths of the placement timeout. Browsers ask for their start a second or two after they were sent.
constexpr std::size_t counted_lifetime = 3;
constexpr std::int64_t max_arrivals = 1'000'000; // that one report may claim
constexpr std::uint32_t max_foreign = 100;       // of one report, from other session servers
constexpr int max_steps = 1'000'000;             // no sum overflows
/// Of one machine: the sum over a fleet must not overflow, whatever machines report.
constexpr double max_seats = 1e6;
/// The part of its room that a machine in its slow start has at first.
constexpr double min_readiness = 0.1;
/// In sessions: the part of a session's cost by which a machine that has the project may be worse.
constexpr double preference_for_cached = 0.5;
/// Percent of a machine's memory: more is not believed of one session, so that no false report about a world
/// closes machines that have much free.
constexpr double max_session_memory = 50;
constexpr double all_of_it = 100; // percent of a machine
/// The rule of the Python servers: only reports count, for choosing and for refusing.
constexpr std::string_view reports_only = "least_reported";

} // namespace

Machine::Machine(ServerSpec const& spec, std::string_view address, SchedulerParams const& params)
    : cost_(params.session_cost), memory_cost_(params.session_memory), ages_(params.placement_timeout)
{
    configure(spec, address);
}

void Machine::configure(ServerSpec const& spec, std::string_view address)
{
    labels_ = spec.labels;
    address_ = address;
    weight_ = spec.weight > 0 && std::isfinite(spec.weight) ? spec.weight : 1;
    drained_ = spec.drain;
}

bool Machine::has_labels(std::vector<std::string> const& labels) const noexcept
{
    return std::ranges::all_of(labels, [this](std::string const& label) {
        return std::ranges::find(labels_, label) != labels_.end() ||
               std::ranges::find(last_.labels, label) != last_.labels.end();
    });
}

int Machine::visible(LoadReport const& report) const noexcept
{
    return report.sessions.value_or(0) - std::min(report.starting.value_or(0), report.sessions.value_or(0));
}

namespace {

using Counter = std::optional<std::int64_t>;

bool fell(Counter const& before, Counter const& now) noexcept
{
    return before && now && *now < *before;
}

/// How much a counter rose; one that began anew rose from 0. At most a million.
std::uint32_t rise_of(Counter const& before, Counter const& now, bool anew) noexcept
{
    if (!now || (!before && !anew))
        return 0;
    std::int64_t const from = anew ? 0 : std::max<std::int64_t>(*before, 0);
    std::int64_t const rise = std::max<std::int64_t>(*now, 0) - from;
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(rise, 0, max_arrivals));
}

} // namespace

/// Counters that fell: the machine was restarted after its last report.
bool Machine::restarted(LoadReport const& report) const noexcept
{
    return fell(last_.arrivals, report.arrivals) || fell(last_.failed, report.failed) ||
           fell(last_.departures, report.departures);
}

namespace {

KnownSessions known_in(LoadReport const& report, int WorldUse::*which, WorldCosts const& costs,
                       AverageSession const& average) noexcept
{
    KnownSessions known;
    for (WorldUse const& use : report.worlds)
        known.add(average.compare(costs.expect(use.key)), use.*which);
    return known;
}

/// How many of its simulations have come or left, at least.
int moved(std::vector<WorldUse> const& before, std::vector<WorldUse> const& now) noexcept
{
    int moves = 0;
    for (WorldUse const& use : now) {
        auto const same = std::ranges::find(before, use.key, &WorldUse::key);
        moves += std::abs(use.running - (same == before.end() ? 0 : same->running));
    }
    for (WorldUse const& use : before)
        if (std::ranges::find(now, use.key, &WorldUse::key) == now.end())
            moves += use.running;
    return moves;
}

} // namespace

/// `more_visible`: how many more sessions show in the load, whichever they are.
Change Machine::change(LoadReport const& report, int more_visible, WorldCosts const& worlds) const noexcept
{
    Change change;
    change.sessions = more_visible;
    change.steps = std::abs(more_visible);
    change.units = more_visible;
    if (!report.sessions || report.worlds.empty() || last_.worlds.empty())
        return change;
    KnownSessions const before = known_in(last_, &WorldUse::running, worlds, average_);
    KnownSessions const now = known_in(report, &WorldUse::running, worlds, average_);
    change.units = now.units_of(visible(report)) - before.units_of(visible(last_));
    change.steps = std::max(change.steps, moved(last_.worlds, report.worlds));
    return change;
}

/// Which of the reservations came is not known: those of known worlds and others alike.
void Machine::settle_known(std::uint32_t before) noexcept
{
    if (before != 0)
        pending_.scale(static_cast<double>(reservations_.count()) / before);
    if (reservations_.count() == 0)
        pending_ = {};
}

Arrivals Machine::report(LoadReport const& report, WorldCosts const& worlds, TimePoint now, bool established)
{
    std::uint32_t const reserved = reservations_.count();
    Arrivals arrivals;
    arrivals.counted = report.sessions.has_value();
    arrivals.exact = report.sessions && report.arrivals;
    placed_.age_until(ages_.eighth(now));
    bool const restart = restarted(report);
    bool const continues =
        reporting() && !restart && last_.sessions.has_value() == report.sessions.has_value();
    if (continues) {
        arrivals.since_last = now - reported_at_;
        int const more_visible =
            report.sessions ? count_arrivals(report, arrivals) : infer_arrivals(report, arrivals);
        Change const change = this->change(report, more_visible, worlds);
        visible_ = known_in(report, &WorldUse::running, worlds, average_);
        arrivals.cost = learn(report, change, now);
        arrivals.surprise = surprise(report.load, change, now);
        follow(report.load, change, now);
    } else {
        // A machine that has sessions was not restarted, unless its counters say so: it was only unreachable.
        bool const came_up = restart || (!established && report.sessions.value_or(0) == 0);
        up_since_ = came_up ? now : TimePoint::min();
        cost_.interrupt();
        memory_cost_.interrupt();
        // From this report nothing can be learned: the level begins where the load is.
        level_ = level_before_ = report.load;
        confirm(0, restart, report, arrivals);
    }
    // Only after the report has confirmed what it shows: none of that has run out.
    expire(now, arrivals);
    settle_known(reserved);
    visible_ = known_in(report, &WorldUse::running, worlds, average_);
    starting_ = known_in(report, &WorldUse::starting, worlds, average_);
    last_ = report;
    reported_at_ = now;
    contact_ = Contact::reporting;
    stale_ = false;
    return arrivals;
}

/// Gives back the reservations of browsers that did not come in time. Where arrivals are counted, that is
/// known soon.
void Machine::expire(TimePoint now, Arrivals& arrivals) noexcept
{
    if (ages_.forgets_at_once()) {
        reservations_.clear(); // browsers that this report does not show came and have left
        return;
    }
    if (reservations_.count() == 0)
        return;
    if (arrivals.counted) {
        arrivals.expired =
            reservations_.age_until(ages_.eighth(now), arrivals.exact ? counted_lifetime : age_count);
        return;
    }
    double const before = unclaimed_visible(now);
    arrivals.expired = reservations_.age_until(ages_.eighth(now));
    if (arrivals.expired == 0)
        return;
    double const part = before > arrivals.expired ? arrivals.expired / before : 1;
    if (cost_.has_shown_unclaimed()) {
        cost_.claim(part);
        return;
    }
    cost_.forget(part);
    placed_.forget(arrivals.expired);
}

/// How many more sessions a bare number would show if every placed browser had come.
double Machine::unclaimed_visible(TimePoint now) const noexcept
{
    if (reservations_.count() == 0)
        return 0;
    Reservations aged = reservations_;
    std::uint32_t const expired = aged.age_until(ages_.eighth(now));
    return visible_of(aged.by_age()) + expired;
}

/// Confirms reservations by `rise`, the sessions that are surely new, and by the counter of arrivals, which
/// no departure hides: one whose start failed has given its reservation back with that.
void Machine::confirm(int rise, bool restart, LoadReport const& report, Arrivals& arrivals) noexcept
{
    if (!arrivals.counted)
        return;
    auto const seen = static_cast<std::uint32_t>(rise);
    std::uint32_t const counted = rise_of(last_.arrivals, report.arrivals, restart);
    std::uint32_t const ours = reservations_.confirm(std::max(seen, counted), true, arrivals.confirmed);
    // Arrivals from other session servers count only as far as the number of sessions shows them, and up to
    // what one machine can have: the estimate is used for all machines.
    arrivals.foreign = std::min(seen, max_foreign) - std::min(ours, std::min(seen, max_foreign));
}

/// Departures hide arrivals in the number of sessions, ends of starts hide them in the number of starts: the
/// larger rise of the two is the better lower bound. Returns how many more are visible in the load.
int Machine::count_arrivals(LoadReport const& report, Arrivals& arrivals) noexcept
{
    int const more_sessions = *report.sessions - *last_.sessions;
    int const more_starting = report.starting.value_or(0) - last_.starting.value_or(0);
    confirm(std::max({more_sessions, more_starting, 0}), false, report, arrivals);
    return visible(report) - visible(last_);
}

/// A load that rose by n sessions' worth confirms n. Returns how many of them are ours.
int Machine::infer_arrivals(LoadReport const& report, Arrivals& arrivals) noexcept
{
    double const rise = (report.load - level_) / cost_.value();
    auto const arrived = static_cast<std::uint32_t>(std::clamp(std::round(rise), 0.0, 1e6));
    std::uint32_t const before = reservations_.count();
    std::uint32_t const ours = reservations_.confirm(arrived, false, arrivals.confirmed);
    if (ours != 0)
        cost_.claim(static_cast<double>(ours) / before);
    return static_cast<int>(ours);
}

/// Moves the level by what became visible, then towards the report as far as that leaves it unexplained.
///
/// While sessions become visible a report may lie anywhere between before and after, and contradicts neither;
/// beyond that small differences are noise and smoothed, and those larger than a session are believed at
/// once.
void Machine::follow(double load, Change const& change, TimePoint now) noexcept
{
    if (!settling(now)) {
        level_before_ = level_;
        steps_ = 0;
        rise_ = 0;
    }
    if (change.steps != 0) {
        steps_ = std::min(steps_ + change.steps, max_steps);
        rise_ += change.units;
        stepped_at_ = now;
        level_ += cost_.value() * change.units;
    }
    double const low = std::min(level_, level_before_);
    double const high = std::max(level_, level_before_);
    double const unexplained = load - std::clamp(load, low, high);
    level_ += (std::abs(unexplained) > cost_.value() ? 1 : gain) * unexplained;
}

bool Machine::settling(TimePoint now) const noexcept
{
    return stepped_at_ != TimePoint::min() && now - stepped_at_ <= averaging;
}

/// When the newest sessions have just become visible in full: how far from their expected cost they are.
std::optional<double> Machine::surprise(double load, Change const& change, TimePoint now) noexcept
{
    if (steps_ == 0 || change.steps != 0 || settling(now))
        return std::nullopt;
    double const difference = (load - level_before_) / cost_.value() - rise_;
    return difference * difference / steps_;
}

/// A departure explains that the load falls, for as long as the filters of the cost remember it.
void Machine::note_departures(LoadReport const& report, TimePoint now) noexcept
{
    if (visible(report) < visible(last_) || rise_of(last_.departures, report.departures, false) > 0)
        left_at_ = now;
}

Evidence Machine::learn(LoadReport const& report, Change const& change, TimePoint now) noexcept
{
    if (!report.sessions)
        return learn_by_placements(report.load, now);
    Seconds const since_last = now - reported_at_;
    double const sessions = (visible(report) + visible(last_)) / 2.0;
    bool const settled = visible(report) == visible(last_);
    note_departures(report, now);
    Doubt doubt;
    doubt.no_departures = left_at_ == TimePoint::min() || now - left_at_ > departure_memory;
    if (report.memory && last_.memory)
        memory_cost_.learn(*report.memory, sessions, since_last, settled, doubt);
    memory_cost_.combine(1, memory_strength);
    // What sessions want explains the load better than how many they are.
    double const units = visible_.units_of(visible(report));
    cost_.weigh(report.load, visible(report), units);
    return cost_.learn(report.load, units - change.units / 2, since_last, settled && change.steps == 0,
                       doubt);
}

/// Where only the load is known: sessions are what was placed, if the load shows that they came. Nobody says
/// when one leaves.
Evidence Machine::learn_by_placements(double load, TimePoint now) noexcept
{
    Doubt doubt;
    doubt.unclaimed = unclaimed_visible(now);
    doubt.no_departures = true;
    return cost_.learn(load, placed_.visible() - doubt.unclaimed, now - reported_at_, true, doubt);
}

void Machine::mark_unreachable() noexcept
{
    if (contact_ == Contact::reporting)
        contact_ = Contact::unreachable;
}

void Machine::place(ExpectedCost const& cost, TimePoint now) noexcept
{
    pending_.add(average_.compare(cost), 1);
    std::int64_t const eighth = ages_.eighth(now);
    placed_.age_until(eighth);
    placed_.add();
    ++placed_in_all_;
    reservations_.add(eighth);
}

void Machine::release(TimePoint placed_at, TimePoint now) noexcept
{
    std::int64_t const added = ages_.eighth(placed_at);
    std::int64_t const age = std::max<std::int64_t>(ages_.eighth(now) - added, 0);
    std::size_t const lifetime = counts_arrivals() ? counted_lifetime : age_count;
    std::uint32_t const reserved = reservations_.count();
    if (age >= static_cast<std::int64_t>(lifetime) || !reservations_.take_back(added))
        return; // it has run out, or somebody else's arrival was taken for this one
    placed_.age_until(added + age);
    placed_.take_back(static_cast<std::size_t>(age));
    settle_known(reserved);
}

double Machine::readiness(TimePoint now, SchedulerParams const& params) const noexcept
{
    if (up_since_ == TimePoint::min() || params.slow_start <= Duration::zero())
        return 1;
    double const passed = Seconds(now - up_since_) / Seconds(params.slow_start);
    return std::clamp(passed, min_readiness, 1.0);
}

/// By reports alone. Unclaimed placements decide between machines, but refuse no browser:
/// anybody can ask for a place and not come.
Refusal Machine::refusal(bool is_taught, SchedulerParams const& params) const noexcept
{
    if (contact_ == Contact::unknown)
        return Refusal::unknown;
    if (contact_ == Contact::unreachable)
        return Refusal::lost;
    if (stale_)
        return Refusal::stale;
    if (drained_ || last_.draining)
        return Refusal::draining;
    if (last_.capacity && view_.sessions >= *last_.capacity)
        return Refusal::full;
    int const starting = last_.starting.value_or(0);
    if (last_.memory && memory_with(starting_, starting) >= params.memory_threshold)
        return Refusal::memory;
    if (last_.load >= params.threshold)
        return Refusal::load;
    // Nor does an assumed cost of sessions refuse a browser: the cost must have been observed in the fleet.
    if (last_.sessions && is_taught &&
        level_ + cost_.value() * starting_.units_of(starting) >= params.threshold &&
        params.policy != reports_only)
        return Refusal::committed;
    return Refusal::none;
}

/// Percent: in use, and with this many sessions more, some of them known.
double Machine::memory_with(KnownSessions const& known, double sessions) const noexcept
{
    if (!last_.memory)
        return 0;
    double const all = *last_.memory + memory_cost_.value() * sessions;
    if (!last_.memory_bytes || known.sized <= 0)
        return all;
    double const sized = std::min(100 * known.memory / *last_.memory_bytes, max_session_memory * known.sized);
    return all + sized - memory_cost_.value() * std::min(known.sized, sessions);
}

bool Machine::lacks_memory(ExpectedCost const& cost, SchedulerParams const& params) const noexcept
{
    if (!last_.memory || !last_.memory_bytes || cost.memory <= 0)
        return false;
    double const own = std::min(100 * cost.memory / *last_.memory_bytes, max_session_memory);
    return memory_ + own >= params.memory_threshold;
}

bool Machine::lacks_room(ExpectedCost const& cost) const noexcept
{
    bool const has_others = view_.sessions + view_.pending > 0;
    if (!cost.is_known || !has_others)
        return false;
    // What sessions were measured to use, where machines say it: the cost that is assumed at first makes a
    // small world a heavy one beside a busy neighbour.
    auto const average = average_.largest();
    double const unit = average > 0 ? 100 * average : cost_.value();
    auto const known = average_.compare(cost);
    double const next = unseen_ + known.mean + std::sqrt(variance_ + known.variance);
    return level_ + unit * next / room_ > all_of_it;
}

/// What a session too many would miss there; `none`: there is room.
Refusal Machine::filled_by_placements(bool is_taught, SchedulerParams const& params) const noexcept
{
    if (last_.capacity && view_.sessions + view_.pending >= *last_.capacity)
        return Refusal::full;
    if (last_.memory && memory_ >= params.memory_threshold)
        return Refusal::memory;
    bool const is_filled = is_taught && view_.committed >= params.threshold && params.policy != reports_only;
    return is_filled ? Refusal::committed : Refusal::none;
}

/// A capacity is often generous, so what sessions are known to cost limits it; an assumed cost does not.
/// Where the machine takes one who can wait (`only_free`), at least this seat is free.
std::uint32_t Machine::seats_left(bool is_taught, SchedulerParams const& params) const noexcept
{
    if (view_.refusal != Refusal::none || view_.overcommitted)
        return 0;
    double seats = max_seats;
    if (last_.capacity)
        seats = std::min(seats, static_cast<double>(*last_.capacity) - view_.sessions - view_.pending);
    if (!last_.capacity || is_taught)
        seats = std::min(seats, (params.threshold - view_.committed) / view_.cost);
    return static_cast<std::uint32_t>(std::max(seats, 1.0));
}

double Machine::score(ExpectedCost const& expected) const noexcept
{
    auto const cost = average_.compare(expected);
    double const own = cost.is_known ? cost.variance : variety_ * variety_;
    double const next = unseen_ + cost.mean + std::sqrt(variance_ + own);
    return std::max(0.0, level_ + cost_.value() * next / room_) / weight_;
}

double Machine::preference(ExpectedCost const& cost) const noexcept
{
    return preference_for_cached * cost_.value() * average_.compare(cost).mean / weight_;
}

bool Machine::has_project(std::uint32_t key) const noexcept
{
    return std::ranges::find(last_.projects, key) != last_.projects.end();
}

void Machine::assess(TimePoint now, Lessons const& lessons, SchedulerParams const& params) noexcept
{
    // The part of this machine that an average session of the fleet takes.
    average_.processors = last_.processors ? lessons.worlds.processors() / *last_.processors : 0;
    average_.graphics =
        last_.graphics_processors ? lessons.worlds.graphics() / *last_.graphics_processors : 0;
    // Where simulations are measured, and nothing else is scarcer, this is exact.
    cost_.combine(lessons.cost.ratio(), lessons.cost.strength(), 100 * average_.largest());
    double const cost = cost_.value();
    // Some browsers never come. Where a machine counts arrivals, their reservations run out soon, and where
    // it does not even count sessions, nobody can tell: then all that are left are expected.
    double const coming = counts_sessions() && !counts_arrivals()
                              ? lessons.show_rate.expected(reservations_.by_age())
                              : reservations_.count();
    // What the load does not show yet: browsers that are on their way, and simulations that are starting. Of
    // some it is known what their world costs.
    KnownSessions unseen = pending_;
    if (reservations_.count() != 0)
        unseen.scale(coming / reservations_.count());
    unseen.add(starting_);
    double const sessions = last_.starting.value_or(0) + coming;
    double const unknown = std::max(0.0, sessions - unseen.count);
    unseen_ = unseen.units_of(sessions);
    variety_ = lessons.variety.value();
    // One session more, and the standard deviation of what all unseen ones may turn out to cost.
    variance_ = unseen.variance + variety_ * variety_ * unknown;
    double const doubt =
        unseen.count == 0 ? variety_ * std::sqrt(sessions + 1) : std::sqrt(variance_ + variety_ * variety_);
    double const next = unseen_ + 1 + doubt;
    room_ = readiness(now, params);
    // What policies see. The refusals are judged by it, so they come last.
    view_.address = address_;
    view_.load = last_.load;
    view_.cost = cost;
    view_.weight = weight_;
    view_.sessions = last_.sessions.value_or(0);
    view_.pending = static_cast<int>(reservations_.count());
    view_.committed = std::max(0.0, level_ + cost * unseen_);
    view_.score = std::max(0.0, level_ + cost * next / room_) / weight_;
    bool const is_taught = lessons.cost.is_taught();
    view_.refusal = refusal(is_taught, params);
    memory_ = memory_with(unseen, sessions);
    auto const filled = filled_by_placements(is_taught, params);
    view_.overcommitted = filled != Refusal::none;
    obstacle_ = view_.refusal == Refusal::none ? filled : view_.refusal;
    free_seats_ = seats_left(is_taught, params);
}

} // namespace webots_cloud::placement
