// The public face of placement: validates parameters, asks the Ranking (placement_ranking.cpp) for
// candidates, lets a policy choose, and keeps the log of decisions. Plain data without clock or task, so that
// simulations replay it a million times.
#include <webots_cloud/scheduler.hpp>

#include "core/machine_labels.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"
#include "placement_log.hpp"
#include "placement_ranking.hpp"
#include "placement_selection.hpp"

#include <algorithm>
#include <cmath>
#include <list>
#include <string>
#include <unordered_set>
#include <utility>

namespace webots_cloud {

namespace {

Failure unusable(std::string detail)
{
    return Failure(errc::invalid_argument, std::move(detail));
}

/// Made for each placement that fails, and seldom told to anybody as it is.
Failure without_info(core::Refused why)
{
    auto const& row = core::row_of(why);
    return Failure(row.kind, std::string(row.sentence));
}

Failure none_available()
{
    return without_info(core::Refused::no_machine);
}

Failure no_room()
{
    return without_info(core::Refused::no_room_for_world);
}

/// Two may turn out to be worse than the third; more would be asked in vain.
constexpr std::size_t asked_at_once = 3;

bool are_labels(std::vector<std::string> const& labels)
{
    return labels.size() <= core::max_labels && std::ranges::all_of(labels, core::is_label);
}

/// Waiting would not help, so that is said.
Failure nobody_has(std::vector<std::string> const& labels)
{
    std::string wanted;
    for (std::string const& label : labels)
        wanted += core::concat(wanted.empty() ? "\"" : ", \"", label, "\"");
    return core::refused(labels.size() == 1 ? core::Refused::nobody_has_label
                                            : core::Refused::nobody_has_labels,
                         {{"labels", wanted}});
}

bool positive(double number)
{
    return std::isfinite(number) && number > 0;
}

bool is_percentage(double number)
{
    return std::isfinite(number) && number >= 0;
}

/// A report that breaks its own contract would spoil every score that it enters.
bool is_usable(LoadReport const& report)
{
    auto const is_count = [](auto const& number) { return !number || *number >= 0; };
    return is_percentage(report.load) && (!report.memory || is_percentage(*report.memory)) &&
           is_count(report.sessions) && is_count(report.starting) && is_count(report.capacity) &&
           is_count(report.arrivals) && is_count(report.failed) && is_count(report.departures) &&
           (!report.processors || positive(*report.processors)) &&
           (!report.memory_bytes || positive(*report.memory_bytes)) &&
           (!report.graphics_processors || positive(*report.graphics_processors)) &&
           std::ranges::all_of(report.worlds, [](WorldUse const& use) {
               return use.running >= 0 && use.starting >= 0 && is_percentage(use.processors) &&
                      is_percentage(use.memory) && is_percentage(use.graphics);
           });
}

} // namespace

result<> validate(SchedulerParams const& params)
{
    if (!params.custom)
        if (auto const policy = scheduling_policy(params.policy); policy.has_error())
            return policy.error();
    if (!positive(params.threshold))
        return unusable("threshold: wanted a positive percentage");
    if (!positive(params.memory_threshold))
        return unusable("memory_threshold: wanted a positive percentage");
    if (!positive(params.session_cost))
        return unusable("session_cost: wanted a positive percentage");
    if (params.session_memory != 0 && !positive(params.session_memory))
        return unusable("session_memory: wanted a percentage, 0 or more");
    if (params.placement_timeout < Duration::zero())
        return unusable("placement_timeout: wanted 0 or more seconds");
    if (params.report_lifetime < Duration::zero())
        return unusable("report_lifetime: wanted 0 or more seconds");
    if (params.slow_start < Duration::zero())
        return unusable("slow_start: wanted 0 or more seconds");
    return {};
}

/// What the public face stands for, at an address that stays where it is when a Scheduler is moved.
struct Scheduler::Impl final : FleetObserver
{
    explicit Impl(SchedulerParams given) : params(std::move(given)), ranking(params) { use_policy(); }

    /// Of `params`, from the next decision on.
    void use_policy()
    {
        std::erase_if(policies, [this](placement::Policy const& policy) {
            return std::ranges::none_of(
                log.records(), [&](placement::Record const& record) { return record.policy == &policy; });
        });
        auto chosen = params.custom ? params.custom : scheduling_policy(params.policy).value();
        policies.push_back({params.policy, std::move(chosen)});
    }

    result<> apply(SchedulerParams next)
    {
        if (auto const usable = validate(next); !usable)
            return usable;
        next.placement_timeout = params.placement_timeout; // reservations are counted in parts of it
        next.seed = params.seed;
        bool const keeps_policy = !next.custom && !params.custom && next.policy == params.policy;
        params = std::move(next);
        if (!keeps_policy)
            use_policy();
        ranking.reassess();
        return {};
    }

    void put(FleetMachine const& machine, FleetMachine const*,
             std::optional<std::string_view> before) override
    {
        auto treated = machine.spec;
        treated.drain = machine.is_draining();
        put_server(treated, before);
    }

    void remove(FleetMachine const& machine) override { remove_server(machine.spec.address); }

    void set_servers(std::vector<ServerSpec> const& servers)
    {
        std::unordered_set<std::string_view> listed;
        for (ServerSpec const& server : servers)
            if (listed.insert(server.address).second)
                put_server(server, std::string_view());
        while (ranking.size() > listed.size())
            remove_server(ranking.machines().front().address()); // the others stand behind those left out
    }

    void put_server(ServerSpec const& server, std::optional<std::string_view> before)
    {
        ranking.put(server, *names.insert(server.address).first, before);
        selection.reserve(ranking.size());
    }

    void remove_server(std::string_view address)
    {
        auto const name = names.find(address);
        if (name == names.end())
            return;
        ranking.remove(address);
        std::erase_if(old_names, [name](OldName const& old) { return old.name == *name; });
        old_names.push_back({*name, is_logged(*name) ? log.last() : 0});
        forget_names();
    }

    /// That of the logged decision, or else the last one of its name.
    result<SchedulingPolicy> find_policy(Decision const& decision) const
    {
        placement::Record const* const record = log.find(decision.id);
        if (record != nullptr && record->policy->name == decision.policy)
            return record->policy->choose;
        auto const found =
            std::find_if(policies.rbegin(), policies.rend(),
                         [&](placement::Policy const& policy) { return policy.name == decision.policy; });
        if (found == policies.rend())
            return Failure(errc::not_found, "the policy of decision " + std::to_string(decision.id) +
                                                " was replaced: " + decision.policy);
        return found->choose;
    }

    bool is_logged(std::string_view name) const
    {
        return std::ranges::any_of(log.records(), [name](placement::Record const& record) {
            auto const entries = std::span(record.entries).first(record.entry_count);
            return record.chosen == name || std::ranges::any_of(entries, [name](auto const& entry) {
                       return entry.machine.address == name;
                   });
        });
    }

    /// Drops the addresses that neither the list nor the log mentions.
    void forget_names()
    {
        std::erase_if(old_names, [this](OldName const& old) {
            bool const is_over =
                old.last_logged == 0 || old.last_logged + placement::logged_decisions <= log.last();
            if (is_over && !ranking.lists(old.name))
                names.erase(names.find(old.name));
            return is_over;
        });
    }

    placement::Record& next_record(TimePoint now)
    {
        placement::Record& record = log.next();
        // Neighbouring states give unrelated numbers: SplitMix64's own seed sequence.
        record.begin(policies.back(), RandomSource(params.seed ^ (record.id << 32 | record.id >> 32))(), now,
                     ranking);
        return record;
    }

    /// Nobody but those for whom they are held may have what is free.
    bool all_held() const noexcept { return held != 0 && ranking.free_seats() <= held; }

    placement::ExpectedCost expect(PlacementRequest const& request) const noexcept
    {
        return request.world.empty() ? placement::ExpectedCost()
                                     : ranking.expect(world_key(request.world, request.mode));
    }

    bool may_be_cached(PlacementRequest const& request) const noexcept
    {
        return !request.world.empty() && ranking.knows_projects();
    }

    void select(PlacementRequest const& request, placement::ExpectedCost const& cost) noexcept
    {
        selection.select(ranking, request, cost);
        if (may_be_cached(request))
            selection.prefer(ranking, project_key(request.world), cost);
    }

    result<Placement> place(PlacementRequest const& request, TimePoint now)
    {
        ranking.expire(now);
        if (!are_labels(request.labels))
            return unusable("labels: wanted at most 32, of letters, digits, \".\", \"_\", \"-\" and \"+\"");
        // Recorded before anything is decided: the log explains refusals, too.
        placement::Record& record = next_record(now);
        auto const cost = expect(request);
        if (cost.is_known)
            record.expected_cost = cost.mean;
        bool const has_asked = request.current_since <= now && ranking.has_others(now);
        // Where every machine suits, the indexes of the ranking know the answer; otherwise all machines are
        // looked at.
        bool const selects = !request.labels.empty() || !request.excluded.empty() || request.only_free ||
                             cost.is_known || may_be_cached(request) || has_asked;
        if (selects) {
            select(request, cost);
            if (has_asked)
                selection.believe_reports(ranking, request.current_since);
            record.restrict_to(selection, request, cost, ranking);
            if (record.offered == 0 && !can_ever_serve(ranking, request))
                return nobody_has(request.labels);
        }
        if (record.offered == 0)
            return selects && selection.too_small() != 0 ? no_room() : none_available();
        if (!request.held && all_held()) {
            record.held = held;
            record.free_seats = ranking.free_seats();
            return none_available();
        }
        if (selects)
            return choose(placement::SelectedSnapshot(ranking, selection, record), record, cost, now);
        return choose(placement::LiveSnapshot(ranking, record), record, cost, now);
    }

    std::vector<std::string_view> worth_asking(PlacementRequest const& request, TimePoint now)
    {
        ranking.expire(now);
        if (!ranking.has_others(now))
            return {};
        select(request, expect(request));
        std::vector<std::string_view> to_ask;
        bool is_first = true;
        for (auto const& entry : selection.best(asked_at_once)) {
            auto const& machine = ranking.machine(entry.slot);
            bool const is_current = machine.shows_arrivals_since(request.current_since);
            // The best one has reported since: asking others would not be worth the wait.
            if (is_first && is_current)
                return {};
            if (!is_current && machine.counts_sessions())
                to_ask.push_back(machine.address());
            is_first = false;
        }
        return to_ask;
    }

    template<class Snapshot>
    result<Placement> choose(Snapshot const& snapshot, placement::Record& record,
                             placement::ExpectedCost const& cost, TimePoint now)
    {
        RandomSource random(record.random);
        std::size_t const position = record.policy->choose(snapshot, random);
        if (position >= record.offered)
            return unusable("scheduling policy: chose machine " + std::to_string(position) + " of " +
                            std::to_string(record.offered));
        record.note(position, snapshot.view(position));
        std::size_t const slot = snapshot.slot(position);
        record.chosen = ranking.machine(slot).address();
        ranking.place(slot, cost, now);
        Placement placement;
        placement.address = record.chosen;
        placement.decision = record.id;
        placement.at = now;
        return placement;
    }

    /// A machine that has left the list, while the log still mentions it.
    struct OldName
    {
        std::string_view name;
        std::uint64_t last_logged = 0; ///< The last decision that may; 0: none does.
    };

    SchedulerParams params;
    PlacementRequest const anybody; ///< Of place(now): made once.
    /// Those of logged decisions; the last one decides.
    std::list<placement::Policy> policies;
    std::unordered_set<std::string, core::TextHash, std::equal_to<>> names;
    std::vector<OldName> old_names;
    placement::Ranking ranking;
    placement::Selection selection; ///< Of the last request that not every machine suits.
    placement::DecisionLog log;
    std::size_t held = 0; ///< Seats.
};

Scheduler::Scheduler() : Scheduler(std::make_unique<Impl>(SchedulerParams())) {}

Scheduler::Scheduler(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

result<Scheduler> Scheduler::make(SchedulerParams params)
{
    if (auto const usable = validate(params); !usable)
        return usable.error();
    return Scheduler(std::make_unique<Impl>(std::move(params)));
}

Scheduler::~Scheduler() = default;
Scheduler::Scheduler(Scheduler&&) noexcept = default;
Scheduler& Scheduler::operator=(Scheduler&&) noexcept = default;

result<> Scheduler::apply(SchedulerParams params)
{
    return impl_->apply(std::move(params));
}

void Scheduler::follow(Fleet& fleet)
{
    fleet.add_observer(*impl_);
}

void Scheduler::set_servers(std::vector<ServerSpec> const& servers)
{
    impl_->set_servers(servers);
}

bool Scheduler::report(std::string_view server, LoadReport const& report, TimePoint now)
{
    return is_usable(report) ? impl_->ranking.report(server, report, now)
                             : impl_->ranking.mark_unreachable(server, now);
}

bool Scheduler::mark_unreachable(std::string_view server, TimePoint now)
{
    return impl_->ranking.mark_unreachable(server, now);
}

void Scheduler::take(LoadEvent const& event, TimePoint now)
{
    if (event.server.state == ServerState::up)
        report(event.server.address, event.server.report, now);
    else
        mark_unreachable(event.server.address, now);
}

result<Placement> Scheduler::place(TimePoint now)
{
    return impl_->place(impl_->anybody, now);
}

result<Placement> Scheduler::place(PlacementRequest const& request, TimePoint now)
{
    return impl_->place(request, now);
}

std::vector<std::string_view> Scheduler::worth_asking(PlacementRequest const& request, TimePoint now) const
{
    return impl_->worth_asking(request, now);
}

void Scheduler::release(Placement const& placement, TimePoint now) noexcept
{
    impl_->ranking.release(placement.address, placement.at, now);
}

std::string Scheduler::save_costs(TimePoint now) const
{
    return impl_->ranking.worlds().save(now);
}

result<> Scheduler::load_costs(std::string_view text, TimePoint now)
{
    auto worlds = placement::WorldCosts::load(text, now);
    if (!worlds)
        return unusable("these are no saved costs of worlds");
    impl_->ranking.replace_worlds(std::move(*worlds));
    return {};
}

bool Scheduler::available(TimePoint now) const
{
    impl_->ranking.expire(now);
    return impl_->ranking.offered() != 0 && !impl_->all_held();
}

std::array<std::size_t, refusal_count> Scheduler::refusals(TimePoint now) const
{
    impl_->ranking.expire(now);
    return impl_->ranking.obstacles();
}

Refusal Scheduler::refusal_of(std::string_view server, TimePoint now,
                              std::vector<std::string> const& labels) const
{
    impl_->ranking.expire(now);
    return impl_->ranking.obstacle_of(server, labels);
}

void Scheduler::hold(std::size_t seats) noexcept
{
    impl_->held = seats;
}

result<Placement> Scheduler::place_held(TimePoint now)
{
    PlacementRequest request;
    request.held = true;
    return impl_->place(request, now);
}

std::size_t Scheduler::free_seats(TimePoint now) const
{
    impl_->ranking.expire(now);
    return impl_->ranking.free_seats();
}

std::vector<Candidate> Scheduler::machines(TimePoint now) const
{
    impl_->ranking.expire(now);
    std::vector<Candidate> machines;
    machines.reserve(impl_->ranking.size());
    for (placement::Machine const& machine : impl_->ranking.machines())
        machines.push_back(machine.view());
    return machines;
}

std::uint64_t Scheduler::placed(std::string_view server) const
{
    return impl_->ranking.placed(server);
}

std::vector<Decision> Scheduler::decisions() const
{
    std::vector<Decision> decisions;
    std::uint64_t const last = impl_->log.last();
    for (std::uint64_t id = last - impl_->log.records().size() + 1; id <= last; ++id)
        decisions.push_back(impl_->log.find(id)->decision());
    return decisions;
}

std::optional<Decision> Scheduler::explain(std::uint64_t decision) const
{
    placement::Record const* const record = impl_->log.find(decision);
    if (record == nullptr)
        return std::nullopt;
    return record->decision();
}

result<std::string> Scheduler::replay(Decision const& decision) const
{
    if (decision.offered == 0 || decision.held != 0)
        return none_available();
    placement::RecordedSnapshot const snapshot(decision);
    RandomSource random(decision.random);
    auto const policy = impl_->find_policy(decision);
    if (!policy)
        return policy.error();
    std::size_t const position = (*policy)(snapshot, random);
    placement::RecordedSnapshot const& recorded = snapshot;
    Decision::Entry const* const chosen = recorded.find(position);
    if (recorded.missed() || chosen == nullptr)
        return Failure(errc::not_found, "decision " + std::to_string(decision.id) +
                                            " was recorded in part only: the ranking was too large");
    return chosen->address;
}

} // namespace webots_cloud
