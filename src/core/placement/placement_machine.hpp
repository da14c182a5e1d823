// One simulation server as placement sees it: what it reported, and what was committed to it since.
#pragma once

#include "placement_estimate.hpp"
#include "placement_reservations.hpp"
#include "world_costs.hpp"

#include <webots_cloud/scheduler.hpp>

namespace webots_cloud::placement {

/// What one report reveals about arrived sessions.
struct Arrivals
{
    AgeCounts confirmed{};          ///< Ours, by the age of their reservations.
    std::uint32_t expired = 0;      ///< Expired reservations.
    std::uint32_t foreign = 0;      ///< Sessions that other session servers placed.
    Seconds since_last{0};          ///< 0: the first report, or the first since the machine was unreachable.
    Evidence cost;                  ///< Evidence about the cost of sessions.
    std::optional<double> surprise; ///< The square of how far newly visible sessions differ from that cost.
    bool counted = false;           ///< The machine reports its number of sessions,
    bool exact = false;             ///< and of arrivals.
};

/// The estimates from all machines of a fleet.
struct Lessons
{
    FleetCost cost;
    SessionVariety variety;
    /// Of machines that count sessions. Elsewhere reservations count in full until it is known that they were
    /// not used: where arrivals are counted that is soon, and a bare number does not show arrivals.
    ShowRate show_rate = ShowRate(0.5);
    ForeignTraffic foreign;
    WorldCosts worlds;
};

/// Sessions of known worlds, among others: in units of the average session.
struct KnownSessions
{
    double count = 0;
    double units = 0;
    double variance = 0;
    double memory = 0; ///< Bytes,
    double sized = 0;  ///< of this many of them.

    void add(ExpectedCost const& cost, double sessions) noexcept
    {
        if (!cost.is_known)
            return;
        count += sessions;
        units += sessions * cost.mean;
        variance += sessions * cost.variance;
        if (cost.memory > 0) {
            memory += sessions * cost.memory;
            sized += sessions;
        }
    }
    void add(KnownSessions const& other) noexcept
    {
        count += other.count;
        units += other.units;
        variance += other.variance;
        memory += other.memory;
        sized += other.sized;
    }
    void scale(double part) noexcept
    {
        count *= part;
        units *= part;
        variance *= part;
        memory *= part;
        sized *= part;
    }
    /// Units of this many sessions, of which these are known.
    double units_of(double sessions) const noexcept { return sessions - count + units; }
};

/// How sessions that became visible, and those that left, change what a machine carries.
struct Change
{
    int sessions = 0; ///< How many more there are.
    int steps = 0;    ///< How many came or left, at least.
    double units = 0; ///< How much more they want.
};

/// What the average session takes of a machine: the share of its processors, and of its graphics processors.
struct AverageSession
{
    double processors = 0;
    double graphics = 0;

    double largest() const noexcept { return std::max(processors, graphics); }

    /// The same session, compared with the average one by that of which there is less on the machine.
    ExpectedCost compare(ExpectedCost cost) const noexcept
    {
        if (graphics <= processors)
            return cost;
        double const factor = cost.graphics / cost.mean;
        cost.variance *= factor * factor;
        cost.mean = cost.graphics;
        return cost;
    }
};

/// The state machine of one server: `unknown`, then `reporting` or `unreachable`.
class Machine
{
public:
    Machine(ServerSpec const& spec, std::string_view address, SchedulerParams const& params);

    std::string_view address() const noexcept { return address_; }
    void configure(ServerSpec const& spec, std::string_view address);

    /// `established`: it may have been up long before this first report, so there is no slow start.
    Arrivals report(LoadReport const& report, WorldCosts const& worlds, TimePoint now, bool established);
    void mark_unreachable() noexcept;
    void stale() noexcept { stale_ = true; }
    void place(ExpectedCost const& cost, TimePoint now) noexcept;
    void release(TimePoint placed_at, TimePoint now) noexcept;

    /// Computes `view()` anew from the state. Call after each of the above.
    void assess(TimePoint now, Lessons const& lessons, SchedulerParams const& params) noexcept;
    Candidate const& view() const noexcept { return view_; }
    /// `view().refusal`, or what placements that no browser has claimed yet fill.
    Refusal obstacle() const noexcept { return obstacle_; }
    /// `view().score`, for a session of which more is known.
    double score(ExpectedCost const& expected) const noexcept;
    /// By how much less than others it may be suited and still be chosen, because it has the project.
    double preference(ExpectedCost const& cost) const noexcept;
    bool has_project(std::uint32_t key) const noexcept;
    /// That session would fill its memory.
    bool lacks_memory(ExpectedCost const& cost, SchedulerParams const& params) const noexcept;
    /// That session, of which something is known, would want more than all of a machine that has others, by
    /// what sessions have been measured to use.
    bool lacks_room(ExpectedCost const& cost) const noexcept;
    /// How many more sessions it has room for: an estimate.
    std::uint32_t free_seats() const noexcept { return free_seats_; }

    bool counts_sessions() const noexcept { return last_.sessions.has_value(); }
    /// Browsers that came there before `since` are in its last report.
    bool shows_arrivals_since(TimePoint since) const noexcept
    {
        return counts_sessions() && reported_at_ >= since;
    }
    bool counts_arrivals() const noexcept { return last_.sessions && last_.arrivals; }
    /// It has reported at least once.
    bool is_known() const noexcept { return contact_ != Contact::unknown; }
    bool has_labels(std::vector<std::string> const& labels) const noexcept;
    bool reporting() const noexcept { return contact_ == Contact::reporting; }
    bool was_unreachable() const noexcept { return contact_ == Contact::unreachable; }
    Evidence cost_evidence() const noexcept { return cost_.evidence(); }
    TimePoint last_report() const noexcept { return reported_at_; }
    /// Of machines with equal scores the smallest turn comes first: the one that got a session longest ago.
    std::uint32_t turn() const noexcept { return turn_; }
    void set_turn(std::uint32_t turn) noexcept { turn_ = turn; }
    /// How many sessions were placed in all.
    std::uint64_t placed() const noexcept { return placed_in_all_; }
    void set_placed(std::uint64_t count) noexcept { placed_in_all_ = count; }

private:
    enum class Contact : std::uint8_t
    {
        unknown,
        reporting,
        unreachable
    };

    int visible(LoadReport const& report) const noexcept;
    bool restarted(LoadReport const& report) const noexcept;
    void confirm(int rise, bool restart, LoadReport const& report, Arrivals& arrivals) noexcept;
    int count_arrivals(LoadReport const& report, Arrivals& arrivals) noexcept;
    int infer_arrivals(LoadReport const& report, Arrivals& arrivals) noexcept;
    void expire(TimePoint now, Arrivals& arrivals) noexcept;
    double unclaimed_visible(TimePoint now) const noexcept;
    Change change(LoadReport const& report, int more_visible, WorldCosts const& worlds) const noexcept;
    void settle_known(std::uint32_t before) noexcept;
    void follow(double load, Change const& change, TimePoint now) noexcept;
    std::optional<double> surprise(double load, Change const& change, TimePoint now) noexcept;
    bool settling(TimePoint now) const noexcept;
    void note_departures(LoadReport const& report, TimePoint now) noexcept;
    Evidence learn(LoadReport const& report, Change const& change, TimePoint now) noexcept;
    Evidence learn_by_placements(double load, TimePoint now) noexcept;
    Refusal refusal(bool is_taught, SchedulerParams const& params) const noexcept;
    double memory_with(KnownSessions const& known, double sessions) const noexcept;
    Refusal filled_by_placements(bool is_taught, SchedulerParams const& params) const noexcept;
    std::uint32_t seats_left(bool is_taught, SchedulerParams const& params) const noexcept;
    double readiness(TimePoint now, SchedulerParams const& params) const noexcept;

    std::string_view address_;
    double weight_ = 1;
    std::vector<std::string> labels_; ///< The operator's; it may report more.
    bool drained_ = false;
    bool stale_ = false;
    Contact contact_ = Contact::unknown;
    LoadReport last_; ///< With which the next report is compared.
    TimePoint reported_at_{};
    TimePoint up_since_ = TimePoint::min();
    TimePoint left_at_ = TimePoint::min(); ///< When a session was last seen to leave.

    SessionCost cost_;
    SessionCost memory_cost_;
    Reservations reservations_;
    AgeClock ages_;

    /// The load that is explained: filtered reports, in percent.
    double level_ = 0;
    /// `level_` before the newest sessions became visible, and when that was.
    double level_before_ = 0;
    TimePoint stepped_at_ = TimePoint::min();
    /// How many sessions came and went since `level_before_`, and how many more there are by that.
    int steps_ = 0;
    double rise_ = 0; ///< In units of sessions.

    AverageSession average_; ///< On this machine.
    KnownSessions visible_;  ///< In the last report.
    KnownSessions starting_; ///< In it, too.
    KnownSessions pending_;  ///< Among the reservations.
    double unseen_ = 0;      ///< Units of sessions that are not visible yet,
    double variance_ = 0;    ///< and how uncertain they are.
    double variety_ = 0;     ///< Of sessions of which nothing is known.
    double room_ = 1;
    double memory_ = 0; ///< Percent: in use, and what starting and placed sessions will need.

    PlacedHistory placed_;
    std::uint64_t placed_in_all_ = 0;

    std::uint32_t turn_ = 0;
    Candidate view_;
    Refusal obstacle_ = Refusal::unknown;
    std::uint32_t free_seats_ = 0;
};

} // namespace webots_cloud::placement
