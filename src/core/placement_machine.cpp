#include "placement_machine.hpp"

#include <algorithm>
#include <cmath>

namespace webots_cloud::placement {

namespace {

using std::chrono::seconds;

/// A report is the mean of five samples, one a second: so long it may show the newest sessions in part.
constexpr Duration averaging = seconds(6);
/// The part of an unexplained difference that one report moves the level by.
constexpr double gain = 0.3;
/// How much evidence outweighs the assumed need of memory, in sessions² s.
constexpr double memory_strength = 60;
/// The part of its room that a machine in its slow start has at first.
constexpr double least_readiness = 0.1;
/// The reference's rule knows no commitments, neither for choosing nor for refusing.
constexpr std::string_view reports_only = "least_reported";

} // namespace

Machine::Machine(ServerSpec const& spec, std::string_view address, SchedulerParams const& params)
    : cost_(params.session_cost), memory_cost_(params.session_memory), ages_(params.placement_timeout)
{
    configure(spec, address);
}

void Machine::configure(ServerSpec const& spec, std::string_view address) noexcept
{
    address_ = address;
    weight_ = spec.weight > 0 && std::isfinite(spec.weight) ? spec.weight : 1;
    drained_ = spec.drain;
}

int Machine::visible(LoadReport const& report) const noexcept
{
    return report.sessions.value_or(0) - std::min(report.starting.value_or(0), report.sessions.value_or(0));
}

Arrivals Machine::report(LoadReport const& report, TimePoint now, bool established,
                         SchedulerParams const& params)
{
    Arrivals arrivals;
    arrivals.counted = report.sessions.has_value();
    placed_.age_until(ages_.eighth(now));
    bool const continues = reporting() && last_.sessions.has_value() == report.sessions.has_value();
    if (continues) {
        arrivals.since_last = now - reported_at_;
        int const more_visible =
            report.sessions ? count_arrivals(report, arrivals) : infer_arrivals(report, arrivals);
        arrivals.cost = learn(report, arrivals.since_last);
        arrivals.surprise = surprise(report.load, more_visible, now);
        follow(report.load, more_visible, now);
    } else {
        if (contact_ == Contact::unknown && report.capacity.value_or(0) > 0)
            cost_ = SessionCost(params.threshold / *report.capacity);
        // A machine that has sessions did not restart: only the way to it was broken.
        bool const restarted = !established && report.sessions.value_or(0) == 0;
        up_since_ = restarted ? now : TimePoint::min();
        cost_.interrupt();
        memory_cost_.interrupt();
        level_ = level_before_ = report.load;
    }
    if (ages_.forgets_at_once())
        reservations_.clear(); // whoever is not in this report came and has gone
    else
        arrivals.expired = reservations_.age_until(ages_.eighth(now));
    last_ = report;
    reported_at_ = now;
    contact_ = Contact::reporting;
    stale_ = false;
    return arrivals;
}

/// Departures hide arrivals in the number of sessions, ends of starts hide them in the number of starts: the
/// larger rise of the two is the better lower bound. Returns how many more are visible in the load.
int Machine::count_arrivals(LoadReport const& report, Arrivals& arrivals) noexcept
{
    int const more_sessions = *report.sessions - *last_.sessions;
    int const more_starting = report.starting.value_or(0) - last_.starting.value_or(0);
    auto const arrived = static_cast<std::uint32_t>(std::max({more_sessions, more_starting, 0}));
    std::uint32_t const ours = reservations_.confirm(arrived, true, arrivals.confirmed);
    arrivals.foreign = arrived - ours;
    return visible(report) - visible(last_);
}

/// A load that rose by n sessions' worth confirms n. Returns how many of them are ours.
int Machine::infer_arrivals(LoadReport const& report, Arrivals& arrivals) noexcept
{
    double const rise = (report.load - level_) / cost_.value();
    auto const arrived = static_cast<std::uint32_t>(std::clamp(std::round(rise), 0.0, 1e6));
    return static_cast<int>(reservations_.confirm(arrived, false, arrivals.confirmed));
}

/// Moves the level by what became visible, then towards the report as far as that leaves it unexplained.
///
/// While sessions become visible a report may lie anywhere between before and after, and contradicts neither;
/// beyond that small differences are noise and smoothed, and those larger than a session are believed at
/// once.
void Machine::follow(double load, int more_visible, TimePoint now) noexcept
{
    if (!settling(now)) {
        level_before_ = level_;
        steps_ = rise_ = 0;
    }
    if (more_visible != 0) {
        steps_ += std::abs(more_visible);
        rise_ += more_visible;
        stepped_at_ = now;
        level_ += cost_.value() * more_visible;
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
std::optional<double> Machine::surprise(double load, int more_visible, TimePoint now) noexcept
{
    if (steps_ == 0 || more_visible != 0 || settling(now))
        return std::nullopt;
    double const difference = (load - level_before_) / cost_.value() - rise_;
    return difference * difference / steps_;
}

Evidence Machine::learn(LoadReport const& report, Seconds since_last) noexcept
{
    if (!report.sessions)
        return cost_.learn(report.load, placed_.visible(), since_last, true);
    double const sessions = (visible(report) + visible(last_)) / 2.0;
    bool const settled = visible(report) == visible(last_);
    if (report.memory && last_.memory)
        memory_cost_.learn(*report.memory, sessions, since_last, settled);
    memory_cost_.combine(1, memory_strength);
    cost_.weigh(report.load, visible(report));
    return cost_.learn(report.load, sessions, since_last, settled);
}

void Machine::lost() noexcept
{
    if (contact_ == Contact::reporting)
        contact_ = Contact::lost;
}

void Machine::place(TimePoint now) noexcept
{
    std::int64_t const eighth = ages_.eighth(now);
    placed_.age_until(eighth);
    placed_.add();
    ++placed_in_all_;
    reservations_.add(eighth);
}

double Machine::readiness(TimePoint now, SchedulerParams const& params) const noexcept
{
    if (up_since_ == TimePoint::min() || params.slow_start <= Duration::zero())
        return 1;
    double const passed = Seconds(now - up_since_) / Seconds(params.slow_start);
    return std::clamp(passed, least_readiness, 1.0);
}

/// A guess decides between machines, but sends nobody away: until the fleet has shown what sessions cost,
/// only reports do.
Refusal Machine::refusal(double committed, double committed_memory, bool is_taught,
                         SchedulerParams const& params) const noexcept
{
    if (contact_ == Contact::unknown)
        return Refusal::unknown;
    if (contact_ == Contact::lost)
        return Refusal::lost;
    if (stale_)
        return Refusal::stale;
    if (drained_ || last_.draining)
        return Refusal::draining;
    if (last_.capacity && view_.sessions + view_.pending >= *last_.capacity)
        return Refusal::full;
    if (last_.memory && committed_memory >= params.memory_threshold)
        return Refusal::memory;
    if (last_.load >= params.threshold)
        return Refusal::load;
    if (is_taught && committed >= params.threshold && params.policy != reports_only)
        return Refusal::committed;
    return Refusal::none;
}

void Machine::assess(TimePoint now, Lessons const& lessons, SchedulerParams const& params) noexcept
{
    cost_.combine(lessons.cost.ratio(), lessons.cost.strength());
    double const cost = cost_.value();
    double const coming = lessons.show_rates[counts_sessions()].expected(reservations_.by_age());
    double const unseen = last_.starting.value_or(0) + coming;
    // One session more, and the standard deviation of what all unseen ones may turn out to cost.
    double const next = unseen + 1 + lessons.variety.value() * std::sqrt(unseen + 1);
    double const room = readiness(now, params);
    view_.address = address_;
    view_.load = last_.load;
    view_.cost = cost;
    view_.weight = weight_;
    view_.sessions = last_.sessions.value_or(0);
    view_.pending = static_cast<int>(reservations_.count());
    view_.committed = std::max(0.0, level_ + cost * unseen);
    view_.score = std::max(0.0, level_ + cost * next / room) / weight_;
    double const memory = last_.memory.value_or(0) + memory_cost_.value() * unseen;
    view_.refusal = refusal(view_.committed, memory, lessons.cost.is_taught(), params);
}

} // namespace webots_cloud::placement
