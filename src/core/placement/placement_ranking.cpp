// Keeps machines in indexes by how full they are, so that choosing among 10,000 costs microseconds; an index
// is repaired where a machine has changed, not sorted anew.
#include "placement_ranking.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::placement {

namespace {

/// Machines that were never given a session have random turns below this, before all others.
constexpr std::uint32_t served = 0x80000000u;
/// The list may be shorter when a machine comes back.
constexpr std::size_t min_departed = 100;

} // namespace

Ranking::Ranking(SchedulerParams const& params) : params_(params), first_turns_(params.seed) {}

void Ranking::put(ServerSpec const& spec, std::string_view name, std::optional<std::string_view> before)
{
    auto const next = before ? slots_.find(*before) : slots_.end();
    auto const place = next == slots_.end() ? machines_.end() : by_slot_[next->second];
    if (auto const known = slots_.find(name); known == slots_.end()) {
        add(spec, name, place);
    } else {
        auto const machine = by_slot_[known->second];
        machine->configure(spec, name);
        if (before)
            machines_.splice(place, machines_, machine);
        assess(known->second, machine->last_report());
    }
    number_in_order();
}

void Ranking::add(ServerSpec const& spec, std::string_view name, std::list<Machine>::iterator place)
{
    auto const machine = machines_.emplace(place, spec, name, params_);
    machine->set_turn(static_cast<std::uint32_t>(first_turns_.below(served)));
    machine->set_placed(placed_before(name));
    auto const slot = static_cast<std::uint32_t>(by_slot_.size());
    slots_.emplace(name, slot);
    by_slot_.push_back(machine);
    places_.emplace_back();
    ++refused_[static_cast<std::size_t>(Refusal::unknown)];
    ++obstacles_[static_cast<std::size_t>(Refusal::unknown)];
    // Room for every machine, so that `offer` never allocates.
    usable_.reserve(by_slot_.capacity());
    by_score_.grow(by_slot_.size());
    by_load_.grow(by_slot_.size());
    most_listed_ = std::max(most_listed_, by_slot_.size());
    assess(slot, machine->last_report());
}

void Ranking::remove(std::string_view server)
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return;
    std::uint32_t const slot = found->second;
    remember(*by_slot_[slot]);
    --refused_[static_cast<std::size_t>(places_[slot].counted)];
    --obstacles_[static_cast<std::size_t>(places_[slot].obstacle)];
    free_seats_ -= places_[slot].seats;
    if (places_[slot].position != nowhere)
        withdraw(slot);
    unlink(slot);
    slots_.erase(found);
    machines_.erase(by_slot_[slot]);
    // The last machine takes the free number: there are no gaps between them.
    renumber(static_cast<std::uint32_t>(by_slot_.size() - 1), slot);
    by_slot_.pop_back();
    places_.pop_back();
    number_in_order();
}

/// To a number that nobody has.
void Ranking::renumber(std::uint32_t from, std::uint32_t to)
{
    for (auto* const index : {&by_score_, &by_load_}) {
        index->set(to, from == to ? TournamentTree::absent : index->key(from));
        index->set(from, TournamentTree::absent);
    }
    if (from == to)
        return;
    by_slot_[to] = by_slot_[from];
    slots_.find(by_slot_[to]->address())->second = to;
    Place const& place = places_[to] = places_[from];
    if (place.position != nowhere)
        usable_[place.position] = to;
    if (place.older != nowhere)
        places_[place.older].newer = to;
    else if (oldest_ == from)
        oldest_ = to;
    if (place.newer != nowhere)
        places_[place.newer].older = to;
    else if (newest_ == from)
        newest_ = to;
}

/// Explanations name the machines of small fleets in the operator's order.
void Ranking::number_in_order()
{
    if (machines_.size() > numbered_in_order)
        return;
    std::uint32_t slot = 0;
    for (auto machine = machines_.begin(); machine != machines_.end(); ++machine, ++slot) {
        by_slot_[slot] = machine;
        slots_.find(machine->address())->second = slot;
    }
    rebuild();
}

/// For when it comes back; whoever left longest ago is forgotten.
void Ranking::remember(Machine const& machine)
{
    if (machine.placed() == 0)
        return;
    departed_.push_back({std::string(machine.address()), machine.placed()});
    departed_by_name_.emplace(departed_.back().name, std::prev(departed_.end()));
    if (departed_.size() <= std::max(min_departed, most_listed_))
        return;
    departed_by_name_.erase(departed_.front().name);
    departed_.pop_front();
}

std::uint64_t Ranking::placed_before(std::string_view server)
{
    auto const known = departed_by_name_.find(server);
    if (known == departed_by_name_.end())
        return 0;
    auto const departed = known->second;
    auto const placed = departed->placed;
    departed_by_name_.erase(known);
    departed_.erase(departed);
    return placed;
}

void Ranking::rebuild()
{
    places_.assign(by_slot_.size(), Place());
    by_score_.reset(by_slot_.size());
    by_load_.reset(by_slot_.size());
    usable_.clear();
    roomy_ = 0;
    free_seats_ = 0;
    refused_.fill(0);
    refused_[static_cast<std::size_t>(Refusal::unknown)] = by_slot_.size();
    obstacles_ = refused_;
    oldest_ = newest_ = nowhere;

    std::vector<std::uint32_t> by_age;
    for (std::uint32_t slot = 0; slot != by_slot_.size(); ++slot)
        if (by_slot_[slot]->reporting())
            by_age.push_back(slot);
    std::ranges::stable_sort(by_age, {},
                             [this](std::uint32_t slot) { return by_slot_[slot]->last_report(); });
    for (std::uint32_t const slot : by_age)
        link_newest(slot);
    for (std::size_t slot = 0; slot != by_slot_.size(); ++slot)
        assess(slot, by_slot_[slot]->last_report());
}

bool Ranking::report(std::string_view server, LoadReport const& report, TimePoint now)
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return false;
    std::uint32_t const slot = found->second;
    if (!first_report_)
        first_report_ = now;
    knows_projects_ = knows_projects_ || !report.projects.empty();
    // A machine that answers soon after our own start was running before; one that first answers later has
    // just started.
    bool const established = now - *first_report_ < params_.slow_start && !by_slot_[slot]->was_unreachable();
    // What a crowded machine gives a simulation is less than it wants.
    if (report.processors && by_slot_[slot]->reporting() && report.load < params_.threshold)
        lessons_.worlds.learn(
            report.worlds, {*report.processors, report.memory_bytes.value_or(0), report.graphics_processors},
            now - by_slot_[slot]->last_report(), now);
    Arrivals const arrivals = by_slot_[slot]->report(report, lessons_.worlds, now, established);
    if (arrivals.counted && !arrivals.exact)
        lessons_.show_rate.record(arrivals.confirmed, arrivals.expired);
    if (arrivals.since_last > Seconds::zero())
        lessons_.cost.learn(arrivals.cost, by_slot_[slot]->cost_evidence(), now);
    if (arrivals.surprise)
        lessons_.variety.record(*arrivals.surprise);
    if (arrivals.counted && arrivals.since_last > Seconds::zero())
        lessons_.foreign.record(arrivals.foreign, arrivals.since_last, now);
    // The list of machines by age, in which `expire` finds the old reports, has it at its new end.
    unlink(slot);
    link_newest(slot);
    assess(slot, now);
    return true;
}

bool Ranking::mark_unreachable(std::string_view server, TimePoint now)
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return false;
    by_slot_[found->second]->mark_unreachable();
    assess(found->second, now);
    return true;
}

void Ranking::place(std::size_t slot, ExpectedCost const& cost, TimePoint now) noexcept
{
    by_slot_[slot]->place(cost, now);
    by_slot_[slot]->set_turn(served | (turns_++ & (served - 1)));
    assess(slot, now);
}

void Ranking::release(std::string_view server, TimePoint placed_at, TimePoint now) noexcept
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return;
    by_slot_[found->second]->release(placed_at, now);
    assess(found->second, now);
}

std::uint64_t Ranking::placed(std::string_view server) const
{
    if (auto const found = slots_.find(server); found != slots_.end())
        return by_slot_[found->second]->placed();
    auto const before = departed_by_name_.find(server);
    return before == departed_by_name_.end() ? 0 : before->second->placed;
}

Refusal Ranking::obstacle_of(std::string_view server, std::vector<std::string> const& labels) const noexcept
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return Refusal::unknown;
    auto const& machine = *by_slot_[found->second];
    return machine.is_known() && !machine.has_labels(labels) ? Refusal::labels : machine.obstacle();
}

void Ranking::expire(TimePoint now) noexcept
{
    if (params_.report_lifetime == Duration::zero())
        return;
    while (oldest_ != nowhere && now - by_slot_[oldest_]->last_report() > params_.report_lifetime) {
        std::uint32_t const slot = oldest_;
        unlink(slot);
        by_slot_[slot]->stale();
        assess(slot, now);
    }
}

std::size_t Ranking::lowest(std::span<std::size_t> positions, std::size_t parts, double where) const noexcept
{
    auto const near = static_cast<std::size_t>(where * static_cast<double>(by_slot_.size()));
    std::size_t const found = by_score_.lowest(positions, parts, near);
    std::size_t offered_here = 0;
    for (; offered_here != found; ++offered_here) {
        std::size_t& entry = positions[offered_here];
        entry = position_of(entry);
        if (entry >= offered())
            break; // those with room come first
    }
    return offered_here;
}

void Ranking::assess(std::size_t slot, TimePoint now) noexcept
{
    Machine& machine = *by_slot_[slot];
    machine.assess(now, lessons_, params_);
    auto const number = static_cast<std::uint32_t>(slot);
    // Sums and numbers are corrected by what has changed: to count all machines anew would take too long.
    free_seats_ += machine.free_seats();
    free_seats_ -= std::exchange(places_[slot].seats, machine.free_seats());
    Refusal const refusal = machine.view().refusal;
    Refusal& counted = places_[slot].counted;
    --refused_[static_cast<std::size_t>(counted)];
    counted = refusal;
    ++refused_[static_cast<std::size_t>(counted)];
    --obstacles_[static_cast<std::size_t>(std::exchange(places_[slot].obstacle, machine.obstacle()))];
    ++obstacles_[static_cast<std::size_t>(machine.obstacle())];
    if (refusal == Refusal::none) {
        bool const roomy = !machine.view().overcommitted;
        offer(number, roomy);
        // Machines without room come after all that have some, whatever their score.
        std::uint64_t const rank = roomy ? 0 : TournamentTree::last;
        by_score_.set(slot, rank | order_key(machine.view().score, machine.turn()));
        by_load_.set(slot, rank | order_key(machine.view().load, machine.turn()));
    } else if (places_[slot].position != nowhere) {
        withdraw(number);
        by_score_.set(slot, TournamentTree::absent);
        by_load_.set(slot, TournamentTree::absent);
    }
}

void Ranking::offer(std::uint32_t slot, bool roomy) noexcept
{
    if (places_[slot].position == nowhere) {
        places_[slot].position = static_cast<std::uint32_t>(usable_.size());
        usable_.push_back(slot); // reserved for all machines: never allocates
    }
    bool const was_roomy = places_[slot].position < roomy_;
    if (roomy && !was_roomy)
        exchange(slot, roomy_++);
    else if (!roomy && was_roomy)
        exchange(slot, --roomy_);
}

void Ranking::withdraw(std::uint32_t slot) noexcept
{
    if (places_[slot].position < roomy_)
        exchange(slot, --roomy_);
    exchange(slot, usable_.size() - 1);
    usable_.pop_back();
    places_[slot].position = nowhere;
}

/// Swaps the positions of a machine and of the one that is at `position`.
void Ranking::exchange(std::uint32_t slot, std::size_t position) noexcept
{
    std::uint32_t const other = usable_[position];
    std::swap(usable_[places_[slot].position], usable_[position]);
    std::swap(places_[slot].position, places_[other].position);
}

void Ranking::unlink(std::uint32_t slot) noexcept
{
    Place& place = places_[slot];
    if (oldest_ != slot && place.older == nowhere)
        return; // not in the list
    (place.older == nowhere ? oldest_ : places_[place.older].newer) = place.newer;
    (place.newer == nowhere ? newest_ : places_[place.newer].older) = place.older;
    place.older = place.newer = nowhere;
}

void Ranking::link_newest(std::uint32_t slot) noexcept
{
    places_[slot].older = newest_;
    (newest_ == nowhere ? oldest_ : places_[newest_].newer) = slot;
    newest_ = slot;
}

} // namespace webots_cloud::placement
