// Decides which simulation server takes the next session, for session servers and for embedders.
//
// No clock, network, threads or global random numbers: every function that depends on time takes `now`.
// In our session server, Fleet is the list of the machines, LoadMonitor polls them and SessionService serves
// the browsers. With a poller and a server of your own, call report(), mark_unreachable() and place(): "In
// your own program" in docs/scheduling.md, and examples/08_behind_your_server.cpp. Begin reading at class
// Scheduler, at the end.
#pragma once

#include <webots_cloud/decision.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/scheduling_policy.hpp>
#include <webots_cloud/server_load.hpp>
#include <webots_cloud/time.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// How the scheduler decides. The defaults suit browsers, machines of some 8 sessions and polls every 5 s.
struct SchedulerParams
{
    SchedulerParams() = default;

    /// `scheduling`: one of those that `scheduling_policy` knows.
    std::string policy = "least_committed";
    /// Your own policy; where set, `policy` is only its name in explanations. What it throws passes through
    /// place() and replay(); no session is placed then.
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

/// Places sessions on simulation servers so that they do not herd.
///
/// Tell it the machines, with set_servers() or a Fleet to follow(), and what they report(), or that they are
/// out of reach; place() each session, and release() a place that will not be used. Sessions go by what is
/// *committed*: what a machine has reported, and what was placed there since and can't be seen yet. The
/// algorithm, why it works and how well: docs/scheduling.md.
///
/// Thread-safety: distinct objects: safe. One object: one thread at a time, const functions included.
///
/// Example: examples/01_schedule.cpp; a policy in ten lines: examples/06_own_policy.cpp; behind a server of
/// your own: examples/08_behind_your_server.cpp.
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

    /// A poll of a machine failed: it is not offered until its next report, being `Refusal::lost`, or still
    /// `unknown` if it has never reported. Your own poller says so here, or the machine is offered until its
    /// last report is older than `report_lifetime`. False: it is not in the list.
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
    /// has the labels, so that waiting would not help: `errc::unavailable` as long as the list is empty, or
    /// one of its machines has never reported; `errc::invalid_argument` for malformed labels.
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
