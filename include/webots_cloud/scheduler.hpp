// Decides which simulation server takes the next session, for session servers and for embedders.
//
// No clock, network, threads or global random numbers: every function that depends on time takes `now`.
// In our session server, Fleet is the list of the machines, LoadMonitor polls them and SessionService serves
// the browsers. With a poller and a server of your own, call report(), mark_unreachable() and place(): "In
// your own program" in docs/scheduling.md, and examples/08_behind_your_server.cpp. Begin reading at class
// Scheduler, at the end.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/server_load.hpp>
#include <webots_cloud/time.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Why a machine is not offered.
enum class Refusal : std::uint8_t
{
    none,      ///< It is offered.
    unknown,   ///< It has not reported yet.
    lost,      ///< Its last poll failed.
    stale,     ///< Its last report is older than `report_lifetime`.
    draining,  ///< It says so itself, or the operator does.
    full,      ///< Its sessions reach its `capacity`.
    memory,    ///< Its memory in use, with what its starting sessions will need, reaches `memory_threshold`.
    load,      ///< Its reported load reaches `threshold`.
    committed, ///< Its reported load does not reach `threshold`, but does with its starting sessions.
    labels,    ///< It lacks a label that this request needs: only in a `Decision`.
    excluded,  ///< This request does not want it: only in a `Decision`.
    room,      ///< This session would make it over-full (`must_fit`): only in a `Decision`.
};
inline constexpr std::size_t refusal_count = 12;

/// The name of a reason, as in `GET /api/decisions`.
std::string_view to_string(Refusal reason) noexcept;

/// What a policy knows about a machine. Percentages are of that machine.
struct Candidate
{
    Candidate() = default;

    std::string_view address; ///< Valid as long as the snapshot that it came from; empty in a `Decision`.
    double load = 0;          ///< Percent: the last report, untouched.
    /// Percent: the smoothed load, and what placed sessions will add to it. May be below `load`.
    double committed = 0;
    double score = 0;  ///< What `least_committed` minimises: `committed` with one session more, weighted.
    double cost = 0;   ///< Percent: how much one session moves the load, as learned.
    double weight = 1; ///< The operator's `ServerSpec::weight`.
    int sessions = 0;  ///< As reported; 0 where the machine reports a bare number.
    int pending = 0;   ///< Placed here, neither confirmed by a report nor timed out.
    Refusal refusal = Refusal::none; ///< Always `none` in a snapshot; a `Decision` lists refused ones too.
    /// Counting placements that no browser has claimed yet, it would be refused as `full`, `memory` or
    /// `committed`. It is offered only while every machine is like that.
    bool overcommitted = false;
    /// It has the project of this request in its cache, and its score was lowered for that.
    bool warm = false;

    bool operator==(Candidate const&) const = default;
};

/// The random numbers of one decision: SplitMix64 (Steele, Lea, Flood 2014), a UniformRandomBitGenerator.
///
/// Own code instead of std::mt19937_64 because its state is 8 bytes instead of 2.5 kB, so that every decision
/// can keep it and be replayed, and because its numbers are the same with every standard library.
class RandomSource
{
public:
    using result_type = std::uint64_t;

    explicit RandomSource(std::uint64_t seed = 0) noexcept : state_(seed) {}

    static constexpr result_type min() noexcept { return 0; }
    static constexpr result_type max() noexcept { return std::numeric_limits<result_type>::max(); }
    result_type operator()() noexcept
    {
        state_ += 0x9e3779b97f4a7c15u;
        std::uint64_t mixed = (state_ ^ (state_ >> 30)) * 0xbf58476d1ce4e5b9u;
        mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
        return mixed ^ (mixed >> 31);
    }
    /// A real number, 0 <= number < 1.
    double uniform() noexcept { return static_cast<double>((*this)() >> 11) * 0x1p-53; }
    /// An integer, 0 <= number < `count`.
    /// Precondition: `count` > 0.
    std::size_t below(std::size_t count) noexcept
    {
        return static_cast<std::size_t>(uniform() * static_cast<double>(count));
    }

private:
    std::uint64_t state_;
};

/// The machines that may take a session at one moment: what a policy chooses from.
///
/// A view, never a copy: it costs nothing to make, however many machines there are. Positions begin with 0
/// and are in no particular order. Everything that a policy reads is written down, so that its decision can
/// be replayed.
class PlacementSnapshot
{
public:
    virtual ~PlacementSnapshot() = default;

    /// How many machines may take a session; at least 1 when a policy is asked.
    virtual std::size_t size() const = 0;
    /// Precondition: `position` < size().
    virtual Candidate operator[](std::size_t position) const = 0;
    /// The machine of the smallest `score`; of equals, the one that was given a session longest ago.
    /// O(log n).
    virtual std::size_t least_committed() const = 0;
    /// The machine of the smallest `load`; of equals likewise.
    virtual std::size_t least_reported() const = 0;
    /// Fills `positions` with the machines of the smallest scores, in that order; returns how many there are.
    ///
    /// Looks at one of `parts` parts of the fleet: the one that holds the share `where` (0 <= where < 1) of
    /// the machines, in whatever order. Parts are about equal; one may be empty of machines that can take a
    /// session. O(k log n) for k positions, k at most `max_lowest`.
    virtual std::size_t lowest(std::span<std::size_t> positions, std::size_t parts, double where) const = 0;
    /// How many sessions others have probably placed on these machines since their reports.
    virtual double unseen_arrivals() const = 0;

    static constexpr std::size_t max_lowest = 16;
};

/// Chooses a position of the snapshot. Pure: what it returns depends on its two arguments only.
using SchedulingPolicy = std::function<std::size_t(PlacementSnapshot const&, RandomSource&)>;

/// The policy of the config key "scheduling": least_committed, least_reported, random or power_of_two.
///
/// Errors: `errc::invalid_argument`, its detail names the four.
result<SchedulingPolicy> scheduling_policy(std::string_view name);

/// How the scheduler decides. The defaults suit browsers, machines of some 8 sessions and polls every 5 s.
struct SchedulerParams
{
    SchedulerParams() = default;

    /// `scheduling`: one of those that `scheduling_policy` knows.
    std::string policy = "least_committed";
    /// Your own policy; where set, `policy` is only its name in explanations.
    SchedulingPolicy custom;

    /// Percent, default 95, positive: a machine of that load, reported or committed, is not offered.
    double threshold = 95;
    /// `memoryThreshold`. Percent, default 90, positive: a machine with that much memory in use is not
    /// offered, however idle its processor: a busy processor makes simulations slow, missing memory kills
    /// them.
    double memory_threshold = 90;

    /// Percent of a machine, default 12, positive: the assumed cost of a session until the machine's own has
    /// been learned. It ranks machines, but never refuses one: `Refusal::committed` begins when sessions have
    /// been seen to come or go. A reported capacity is a ceiling, often generous, and says nothing about it.
    double session_cost = 12;
    /// Percent of a machine's memory, default 2, not negative: likewise.
    double session_memory = 2;

    /// `placementTimeout`. Default 60 s, not negative: how long a browser that was sent to a machine may take
    /// to show up in its reports; then its place is given back. Longer than the slowest start, as peers that
    /// report a bare number show a session only when it runs. Of peers that count `arrivals`, three eighths
    /// of it.
    Duration placement_timeout = std::chrono::seconds(60);
    /// Default 15 s: how long a report is trusted. Two intervals of your polls and a time-out are right; less
    /// than an interval makes every machine stale. 0: for ever, for callers that call mark_unreachable().
    Duration report_lifetime = std::chrono::seconds(15);
    /// Default 30 s; 0: none. During this time a machine that came (back) up is filled cautiously: its caches
    /// are cold, and being empty it would get every session of the next seconds.
    Duration slow_start = std::chrono::seconds(30);

    /// Default 1. Same seed, same calls: same decisions. Give each of several session servers that share
    /// machines a different one, so that they do not break ties alike.
    std::uint64_t seed = 1;
};

/// Says what is wrong with the parameters, if anything.
/// Errors: `errc::invalid_argument` naming the field.
result<> validate(SchedulerParams const& params);

/// What is known of a session that is to be placed.
struct PlacementRequest
{
    PlacementRequest() = default;

    /// Only machines with all of these labels come into question: their own (`LoadReport::labels`) and those
    /// of their `ServerSpec`. Letters, digits, `.`, `_`, `-` and `+`, at most 40 in each, at most 32 labels.
    std::vector<std::string> labels;
    /// The address of its world and its mode, as in `start`: what machines have reported of that world's
    /// sessions decides where this one has room; of machines that are about equally good, one that has its
    /// project in its cache is chosen. Empty: it counts as the average session.
    std::string world;
    std::string mode;
    /// Machines, by their entries of "simulationServers", that do not come into question: some that have
    /// refused this session, for instance.
    std::vector<std::string> excluded;
    /// For callers who can wait: fails, instead of choosing the least overcommitted machine, where each that
    /// is offered would be `full`, `memory` or `committed` if all placements were sessions. An assumed
    /// `session_cost` fills no machine.
    bool only_free = false;
    /// For callers who can wait a moment, with `only_free`: a machine that has sessions is not chosen if this
    /// one would make it over-full, by what its world is known to need; fails with `too_large` if that leaves
    /// none of the free machines. A session of which nothing is known fits everywhere.
    bool must_fit = false;
    /// Seats are held for it: see Scheduler::hold().
    bool held = false;
    /// Reports made since then include all sessions that others have placed: for callers that ask machines
    /// before they place (Scheduler::worth_asking()), and whose browsers arrive at once. By default, no
    /// report does.
    TimePoint current_since = TimePoint::max();
};

/// Where a session goes.
struct Placement
{
    Placement() = default;

    /// The entry of "simulationServers".
    /// Lifetime: until that server leaves the list.
    std::string_view address;
    /// For Scheduler::explain.
    std::uint64_t decision = 0;
    /// When it was made: for Scheduler::release.
    TimePoint at{};
};

/// One call of place() with all that led to its answer: a value of its own, no view of the scheduler.
///
/// Why `chosen` was chosen: with `least_committed` it has the smallest `score` of the entries with a
/// `position`, as far as `unseen_arrivals` lets the policy trust them. An entry without one has a `refusal`,
/// or is `overcommitted`. A place() that found nothing is `decisions().back()`, unless its labels made no
/// sense: that is no decision.
struct Decision
{
    Decision() = default;

    std::uint64_t id = 0;
    TimePoint at{};
    std::string policy;
    /// The server chosen; empty: none could be.
    std::string chosen;
    /// The state of the RandomSource that the policy was given.
    std::uint64_t random = 0;
    double unseen_arrivals = 0;
    /// How many machines were offered to the policy.
    std::size_t offered = 0;
    /// How many machines there were for each `Refusal`.
    std::array<std::size_t, refusal_count> refused{};
    /// What the session was believed to want, as a multiple of the average one, where its world was known.
    std::optional<double> expected_cost;
    /// Nobody was placed, although machines were offered: this many of `free_seats` were held for others.
    std::size_t held = 0;
    std::size_t free_seats = 0;

    /// One machine and its position in the snapshot; those that were not offered have none.
    struct Entry
    {
        Entry() = default;

        Candidate machine;
        std::string address;
        std::optional<std::size_t> position;
    };
    /// Fleets of up to 64 machines whole, in the operator's order; of larger ones the first 64 that the
    /// policy looked at. `machine.address` is empty here: `address` owns it.
    std::vector<Entry> machines;
    /// What the functions of the snapshot of these names last told the policy; empty where it did not ask.
    std::vector<std::size_t> lowest;
    std::optional<std::size_t> least_committed;
    std::optional<std::size_t> least_reported;
    /// Everything that the policy looked at is in `machines`, so replay() is possible.
    bool complete = true;
};

/// Places sessions on simulation servers so that they do not herd.
///
/// The problem
///
/// A machine's report is seconds old, and a session that starts shows in it half a minute later.
/// Whoever places on what is *reported* sends everybody who comes in between to one machine, and the
/// older the report, the worse.
///
/// The algorithm
///
/// Place on what is *committed*: what was reported, and what was placed since and can't be seen yet.
/// For a machine of weight w, next goes where the score
///
///     score = (level + cost * (u + 1 + v * sqrt(u + 1)) / readiness) / w,     u = starting + expected
///
/// is smallest, among those that no hard rule refuses (see `Refusal`). Rules refuse by what machines
/// report, never by what was placed: anybody can ask for a place and not come. A machine that our
/// placements would fill is passed over while another has room, and where all are like that the
/// smallest score decides as ever; a browser too many is told so by the machine itself. The parts:
///
/// - level, the load that is explained. It rises by `cost` for every session that becomes visible, and
///   follows the report beyond that. While sessions become visible, a report (a mean of five samples)
///   may lie anywhere between before and after and contradicts neither; what lies outside is followed
///   by 0.3 a report, or at once when it is more than a session's worth. So noise does not decide who
///   is next, and a heavy world is believed immediately.
/// - starting, as the machine counts them, and expected, what our reservations will still become.
///   Our own machines count everybody who ever came: their counters confirm a reservation without doubt,
///   even for a browser that has left or whose start has failed; one that is not counted within three
///   eighths of `placement_timeout` is not coming. Counters that fall are those of a machine that came
///   up anew. Without them a reservation is confirmed when a report counts more sessions or more starts
///   than the one before, and ends when it was not after `placement_timeout`; until then it counts with
///   the probability that a browser comes at all that has not been seen until now: the actuary's estimate
///   from those whose fate is known, 1 where everybody comes, and a half at least before a report can show
///   it.
/// - cost, how much a session moves this machine's load: the slope of load against sessions, both
///   through one high-pass filter, by clipped least squares; towards the fleet's slope with a weight
///   that falls as machines are found to disagree (empirical Bayes); and where there are many sessions,
///   also the load divided by them. A fall that no departure explains teaches nothing, and neither does a
///   capacity, which is a ceiling.
/// - v, how different sessions are: the relative standard deviation of their costs, learned from how
///   far load steps miss what was expected. A mean and one standard deviation of what the unseen will
///   cost: caution that is nothing where sessions are alike and keeps the unknown off small machines
///   where they are not.
/// - readiness, 0.1 rising to 1 during `slow_start`: what is placed on a machine that just came up
///   counts up to ten times. It takes its share when the others are fuller, not everybody at once.
///
/// Peers of the previous generation report a bare number. There `starting` is 0, a rise of the load by
/// n costs confirms n reservations, oldest first, and the slope is taken over what we had placed some
/// 20 to 40 s before, as far as the load shows that somebody came: placements of which it shows no
/// trace are taken for browsers that did not, not for sessions that cost nothing.
///
/// Machines with equal scores take turns: first the one that was given a session longest ago, beginning with
/// a random order.
///
/// Other session servers on the same machines are seen too: sessions that arrive and are not ours, per
/// second, times the time that an arrival stays unseen, are poured over the lowest scores as water
/// finds its level, and each placement goes to one of those machines with the probability of the water
/// it holds (Dahlin's interpretation of old loads). Five session servers then need not talk to each
/// other; with none besides us there is no water, and the rule is exactly the smallest score. So it is
/// where the best machine has been asked a moment ago, as nothing is unseen there: see worth_asking().
///
/// Why it works
///
/// With fresh reports this is join-the-shortest-queue, which no rule beats for like machines and
/// exponential times (Winston 1977). With old ones our own arrivals, the only thing that changes fast
/// and the only thing that we know exactly, are added without delay, so that an old report costs
/// balance only by what *left* since. docs/scheduling.md has the figures: how well it places, what was
/// tried and rejected, and what it costs.
///
/// Thread-safety: distinct objects: safe. One object: one thread at a time, const functions included.
///
/// Example: examples/01_schedule.cpp; a policy in ten lines: examples/06_own_policy.cpp; behind a server of
/// your own: examples/08_behind_your_server.cpp.
///
/// Sources: M. Mitzenmacher, "The Power of Two Choices in Randomized Load Balancing", PhD thesis 1996,
/// and "How Useful Is Old Information?", IEEE TPDS 11 (2000); N. Vvedenskaya, R. Dobrushin, F.
/// Karpelevich, "Queueing System with Selection of the Shortest of Two Queues", 1996; M. Dahlin,
/// "Interpreting Stale Load Information", IEEE TPDS 11 (2000); W. Winston, "Optimality of the Shortest
/// Line Discipline", J. Appl. Prob. 14 (1977).
class Scheduler
{
public:
    /// With the default parameters.
    Scheduler();

    /// Errors: as validate().
    static result<Scheduler> make(SchedulerParams params);

    ~Scheduler();
    Scheduler(Scheduler&&) noexcept;
    Scheduler& operator=(Scheduler&&) noexcept;

    /// What is known of the costs of worlds, as text, to be loaded after a restart: some 200 kB at most, of
    /// those seen last.
    std::string save_costs(TimePoint now) const;
    /// Replaces what is known of the costs of worlds by what was saved, as old as it was then.
    ///
    /// Errors: `errc::invalid_argument` when the text was not written by save_costs(); then nothing changes.
    result<> load_costs(std::string_view text, TimePoint now);

    /// Its machines are those of the fleet, from now on. Those that the fleet drains get no more sessions;
    /// those that they have stay. Each change is O(log n).
    ///
    /// Lifetime: either may end first.
    void follow(Fleet& fleet);

    /// Replaces the list of machines: new ones are added, those missing are forgotten; known ones take the
    /// new weight, drain and labels, and what was learned about them stays. Of entries with one address the
    /// first counts; a weight that is not positive counts as 1.
    ///
    /// Precondition: it does not follow() a fleet; a list comes from one of the two.
    void set_servers(std::vector<ServerSpec> const& servers);

    /// Takes other parameters, a policy of your own included, but for `placement_timeout` and `seed`, which
    /// stay. `session_cost` and `session_memory` are assumed of machines that are listed from now on. What is
    /// known about machines stays, and so do the explanations of past decisions.
    ///
    /// Errors: as validate(), and the old ones stay.
    result<> apply(SchedulerParams params);

    /// A machine answered a poll. One with a number that is negative or not finite counts as a failed poll:
    /// see `mark_unreachable`. False: it is not in the list.
    bool report(std::string_view server, LoadReport const& report, TimePoint now);

    /// A poll of a machine failed: it is not offered until its next report. Your own poller says so here, or
    /// the machine is offered until its last report is older than `report_lifetime`. False: it is not in the
    /// list.
    bool mark_unreachable(std::string_view server, TimePoint now);

    /// What a LoadMonitor found, with LoadMonitor::next_events: report(), or mark_unreachable() where the
    /// poll failed.
    void take(LoadEvent const& event, TimePoint now);

    /// Chooses a machine and commits one session to it. Allocates nothing when it succeeds.
    ///
    /// Precondition: `now` never goes back, here and in all other functions.
    /// Errors: `errc::unavailable`, "no simulation server available at the moment.", when no machine is
    /// offered (see `Refusal`), or all free seats are held; placements alone never cause it;
    /// `errc::invalid_argument` when a policy of your own returned a position that does not exist.
    result<Placement> place(TimePoint now);

    /// The same for a session of which more is known. O(n) where its world is known or machines report
    /// projects, and where not every machine that is offered comes into question.
    ///
    /// Errors: as place(now), but for held seats where they are for it; `errc::too_large`, see
    /// `PlacementRequest::must_fit`; `errc::refused`, with a sentence for people, when no machine of the list
    /// has the labels, so that waiting would not help; `errc::invalid_argument` for malformed labels.
    result<Placement> place(PlacementRequest const& request, TimePoint now);

    /// Whom to ask for a report before this session is placed, the best machine first: of the three best
    /// machines, those that have not reported since `request.current_since`. Nobody is to be asked where the
    /// best one has, where machines report a bare number, which shows nobody who has just come, and where
    /// nobody else has placed sessions for a day. Once the reports are here, another machine may be the best.
    /// O(n).
    ///
    /// Lifetime: addresses are valid until the server leaves the list.
    std::vector<std::string_view> worth_asking(PlacementRequest const& request, TimePoint now) const;

    /// Gives a place back that will not be used: the browser left before it went to the machine, or the
    /// machine could not be reached. Without it, the place counts until reports show that nobody came.
    ///
    /// Does nothing when that is known already, when the server has left the list, or when its reports show
    /// everybody who was placed there.
    /// Precondition: once for a placement, and not when the browser has reached the machine: a start that
    /// failed there is in its reports.
    void release(Placement const& placement, TimePoint now) noexcept;

    /// Would place() find a machine now? What browsers see as 1 or 0. O(1).
    bool available(TimePoint now) const;

    /// How many machines there are for each `Refusal`, `none` included. Unlike place(now), this counts
    /// placements that no browser has claimed yet: machines that they fill are `full`, `memory` or
    /// `committed`, as for callers who can wait (`PlacementRequest::only_free`). O(1).
    std::array<std::size_t, refusal_count> refusals(TimePoint now) const;
    /// The same of one machine, for a session that needs these labels; `unknown` where it is not in the list.
    /// O(1).
    Refusal refusal_of(std::string_view server, TimePoint now,
                       std::vector<std::string> const& labels = {}) const;

    /// Keeps this many of the free seats for place_held(), such as those of a class that is about to begin:
    /// while no more are free, place() fails. 0, as at first, holds nothing. Replaces what was held before:
    /// pass the sum over all classes, less those students who were placed and are still there. More than is
    /// free may be held: seats that become free are then held, too. No machine is set apart: browsers
    /// that are placed, by either function, go where the policy says.
    void hold(std::size_t seats) noexcept;
    /// As place(), for those for whom seats are held: refused only where no machine is offered.
    ///
    /// Errors: as place(), but for held seats.
    result<Placement> place_held(TimePoint now);
    /// How many more sessions the machines have room for, held seats included: an estimate, but 0 exactly
    /// where `PlacementRequest::only_free` finds no machine.
    ///
    /// Of each machine that is offered and that placements do not fill, `capacity` less sessions and
    /// placements that no report shows yet; no more than its load leaves room for, once the fleet has taught
    /// what a session costs; of one that reports no capacity, what its load leaves room for; and 1 at least.
    /// O(1).
    std::size_t free_seats(TimePoint now) const;

    /// What is known about every machine, in the operator's order. For monitor pages.
    /// Lifetime: addresses are valid until the server leaves the list.
    std::vector<Candidate> machines(TimePoint now) const;
    /// How many sessions were placed there in all. Counts of servers that left the list are kept for when
    /// they come back: those of the last 100, or of as many as were ever listed at once.
    std::uint64_t placed(std::string_view server) const;

    /// The last 100 decisions, oldest first.
    std::vector<Decision> decisions() const;

    /// One of them; empty when it is older than those, or never was.
    std::optional<Decision> explain(std::uint64_t decision) const;

    /// Lets the decision's policy decide again from what the decision recorded: the address it chooses,
    /// `decision.chosen` as long as the policy is a pure function.
    /// Errors: `errc::unavailable` when no machine was offered; `errc::not_found` when the record is not
    /// complete, or when the policy was replaced and none of the last 100 decisions used it.
    result<std::string> replay(Decision const& decision) const;

private:
    struct Impl;
    explicit Scheduler(std::unique_ptr<Impl> impl);

    std::unique_ptr<Impl> impl_;
};

/// The body of `GET /api/decisions`: the last 100 decisions, newest first, as JSON. `now` gives their ages.
std::string decisions_json(Scheduler const& scheduler, TimePoint now);

} // namespace webots_cloud
