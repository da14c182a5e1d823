#include "placement_fleet.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::placement {

namespace {

/// Machines that were never given a session have random turns below this, before all others.
constexpr std::uint32_t served = 0x80000000u;
/// The list may be shorter when a machine comes back.
constexpr std::size_t min_departed = 100;

} // namespace

Fleet::Fleet(SchedulerParams const& params) : params_(params), first_turns_(params.seed) {}

void Fleet::set_servers(std::vector<ServerSpec> const& specs, std::vector<std::string_view> const& names)
{
    decltype(slots_) slots;
    slots.reserve(specs.size());
    std::vector<std::size_t> entries;
    for (std::size_t entry = 0; entry != specs.size(); ++entry)
        if (slots.try_emplace(names[entry], static_cast<std::uint32_t>(entries.size())).second)
            entries.push_back(entry); // the first one of an address counts
    for (Machine const& machine : machines_)
        if (machine.placed() != 0 && !slots.contains(machine.address()))
            departed_[std::string(machine.address())] = {machine.placed(), ++departures_};
    std::vector<Machine> machines;
    machines.reserve(entries.size());
    for (std::size_t const entry : entries) {
        auto const known = slots_.find(names[entry]);
        if (known == slots_.end()) {
            machines.emplace_back(specs[entry], names[entry], params_);
            machines.back().set_turn(static_cast<std::uint32_t>(first_turns_.below(served)));
            if (auto const before = departed_.extract(std::string(names[entry])))
                machines.back().set_placed(before.mapped().placed);
        } else {
            machines.push_back(std::move(machines_[known->second]));
            machines.back().configure(specs[entry], names[entry]);
        }
    }
    forget_departed(std::max(min_departed, machines_.size()));
    machines_ = std::move(machines);
    slots_ = std::move(slots);
    rebuild();
}

/// Keeps those that left last.
void Fleet::forget_departed(std::size_t max)
{
    if (departed_.size() <= max)
        return;
    std::vector<std::uint64_t> order;
    for (auto const& [name, departed] : departed_)
        order.push_back(departed.order);
    auto const oldest_kept = order.end() - static_cast<std::ptrdiff_t>(max);
    std::nth_element(order.begin(), oldest_kept, order.end());
    std::erase_if(departed_, [&](auto const& entry) { return entry.second.order < *oldest_kept; });
}

void Fleet::rebuild()
{
    places_.assign(machines_.size(), Place());
    by_score_.reset(machines_.size());
    by_load_.reset(machines_.size());
    usable_.clear();
    usable_.reserve(machines_.size());
    roomy_ = 0;
    free_seats_ = 0;
    refused_.fill(0);
    refused_[static_cast<std::size_t>(Refusal::unknown)] = machines_.size();
    oldest_ = newest_ = nowhere;

    std::vector<std::uint32_t> by_age;
    for (std::uint32_t slot = 0; slot != machines_.size(); ++slot)
        if (machines_[slot].reporting())
            by_age.push_back(slot);
    std::ranges::stable_sort(by_age, {},
                             [this](std::uint32_t slot) { return machines_[slot].last_report(); });
    for (std::uint32_t const slot : by_age)
        link_newest(slot);
    for (std::size_t slot = 0; slot != machines_.size(); ++slot)
        assess(slot, machines_[slot].last_report());
}

void Fleet::report(std::string_view server, LoadReport const& report, TimePoint now)
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return;
    std::uint32_t const slot = found->second;
    if (!first_report_)
        first_report_ = now;
    knows_projects_ = knows_projects_ || !report.projects.empty();
    // A machine that answers soon after our own start was running before; one that first answers later has
    // just started.
    bool const established = now - *first_report_ < params_.slow_start && !machines_[slot].was_unreachable();
    // What a crowded machine gives a simulation is not what that wants.
    if (report.processors && machines_[slot].reporting() && report.load < params_.threshold)
        lessons_.worlds.learn(report.worlds, {*report.processors, report.memory_bytes.value_or(0)},
                              now - machines_[slot].last_report(), now);
    Arrivals const arrivals = machines_[slot].report(report, lessons_.worlds, now, established);
    if (arrivals.counted && !arrivals.exact)
        lessons_.show_rate.record(arrivals.confirmed, arrivals.expired);
    if (arrivals.since_last > Seconds::zero())
        lessons_.cost.learn(arrivals.cost, machines_[slot].cost_evidence(), now);
    if (arrivals.surprise)
        lessons_.variety.record(*arrivals.surprise);
    if (arrivals.counted && arrivals.since_last > Seconds::zero())
        lessons_.foreign.record(arrivals.foreign, arrivals.since_last, now);
    unlink(slot);
    link_newest(slot);
    assess(slot, now);
}

void Fleet::mark_unreachable(std::string_view server, TimePoint now)
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return;
    machines_[found->second].mark_unreachable();
    assess(found->second, now);
}

void Fleet::place(std::size_t slot, ExpectedCost const& cost, TimePoint now) noexcept
{
    machines_[slot].place(cost, now);
    machines_[slot].set_turn(served | (turns_++ & (served - 1)));
    assess(slot, now);
}

void Fleet::release(std::string_view server, TimePoint placed_at, TimePoint now) noexcept
{
    auto const found = slots_.find(server);
    if (found == slots_.end())
        return;
    machines_[found->second].release(placed_at, now);
    assess(found->second, now);
}

std::uint64_t Fleet::placed(std::string_view server) const
{
    if (auto const found = slots_.find(server); found != slots_.end())
        return machines_[found->second].placed();
    auto const before = departed_.find(std::string(server));
    return before == departed_.end() ? 0 : before->second.placed;
}

void Fleet::expire(TimePoint now) noexcept
{
    if (params_.report_lifetime == Duration::zero())
        return;
    while (oldest_ != nowhere && now - machines_[oldest_].last_report() > params_.report_lifetime) {
        std::uint32_t const slot = oldest_;
        unlink(slot);
        machines_[slot].stale();
        assess(slot, now);
    }
}

std::size_t Fleet::lowest(std::span<std::size_t> positions, std::size_t parts, double where) const noexcept
{
    auto const near = static_cast<std::size_t>(where * static_cast<double>(machines_.size()));
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

void Fleet::assess(std::size_t slot, TimePoint now) noexcept
{
    Machine& machine = machines_[slot];
    machine.assess(now, lessons_, params_);
    auto const number = static_cast<std::uint32_t>(slot);
    free_seats_ += machine.free_seats();
    free_seats_ -= std::exchange(places_[slot].seats, machine.free_seats());
    Refusal const refusal = machine.view().refusal;
    Refusal& counted = places_[slot].counted;
    --refused_[static_cast<std::size_t>(counted)];
    counted = refusal;
    ++refused_[static_cast<std::size_t>(counted)];
    if (refusal == Refusal::none) {
        bool const roomy = !machine.view().overcommitted;
        offer(number, roomy);
        std::uint64_t const rank = roomy ? 0 : TournamentTree::last;
        by_score_.set(slot, rank | order_key(machine.view().score, machine.turn()));
        by_load_.set(slot, rank | order_key(machine.view().load, machine.turn()));
    } else if (places_[slot].position != nowhere) {
        withdraw(number);
        by_score_.set(slot, TournamentTree::absent);
        by_load_.set(slot, TournamentTree::absent);
    }
}

void Fleet::offer(std::uint32_t slot, bool roomy) noexcept
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

void Fleet::withdraw(std::uint32_t slot) noexcept
{
    if (places_[slot].position < roomy_)
        exchange(slot, --roomy_);
    exchange(slot, usable_.size() - 1);
    usable_.pop_back();
    places_[slot].position = nowhere;
}

/// Swaps the positions of a machine and of the one that is at `position`.
void Fleet::exchange(std::uint32_t slot, std::size_t position) noexcept
{
    std::uint32_t const other = usable_[position];
    std::swap(usable_[places_[slot].position], usable_[position]);
    std::swap(places_[slot].position, places_[other].position);
}

void Fleet::unlink(std::uint32_t slot) noexcept
{
    Place& place = places_[slot];
    if (oldest_ != slot && place.older == nowhere)
        return; // not in the list
    (place.older == nowhere ? oldest_ : places_[place.older].newer) = place.newer;
    (place.newer == nowhere ? newest_ : places_[place.newer].older) = place.older;
    place.older = place.newer = nowhere;
}

void Fleet::link_newest(std::uint32_t slot) noexcept
{
    places_[slot].older = newest_;
    (newest_ == nowhere ? oldest_ : places_[newest_].newer) = slot;
    newest_ = slot;
}

} // namespace webots_cloud::placement
