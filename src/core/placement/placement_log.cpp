// Keeps the last decisions with all that they saw, so that one can be explained or repeated later. Placing
// must not allocate, hence records of a fixed size.
#include "placement_log.hpp"

#include "placement_selection.hpp"

#include <algorithm>

namespace webots_cloud::placement {

namespace {

constexpr std::size_t no_position = std::numeric_limits<std::size_t>::max();

} // namespace

void Record::begin(Policy const& decides, std::uint64_t seed, TimePoint now, Ranking const& ranking) noexcept
{
    policy = &decides;
    at = now;
    random = seed;
    unseen_arrivals = ranking.unseen_arrivals();
    offered = ranking.offered();
    refused = ranking.refused();
    held = free_seats = 0;
    expected_cost.reset();
    chosen = {};
    complete = true;
    lowest_count = 0;
    least_committed.reset();
    least_reported.reset();
    // A small fleet is recorded as a whole. Of a large one only the machines that the policy looks at
    // (`note`).
    whole_fleet = ranking.size() <= logged_machines;
    entry_count = whole_fleet ? ranking.size() : 0;
    for (std::size_t slot = 0; slot != entry_count; ++slot) {
        Candidate const& machine = ranking.machine(slot).view();
        bool const offered_now = machine.refusal == Refusal::none && ranking.position_of(slot) < offered;
        entries[slot].machine = machine;
        entries[slot].position = offered_now ? ranking.position_of(slot) : no_position;
    }
}

void Record::restrict_to(Selection const& selection, PlacementRequest const& request,
                         ExpectedCost const& cost, Ranking const& ranking) noexcept
{
    auto const chosen_ones = selection.entries();
    offered = chosen_ones.size();
    refused[static_cast<std::size_t>(Refusal::labels)] = selection.lacking();
    refused[static_cast<std::size_t>(Refusal::excluded)] = selection.excluded();
    refused[static_cast<std::size_t>(Refusal::room)] = selection.too_small();
    unseen_arrivals = selection.unseen_arrivals();
    // Machines that did not suit this request say why.
    for (std::size_t slot = 0; slot != entry_count; ++slot) {
        Entry& entry = entries[slot];
        entry.position = no_position;
        if (entry.machine.refusal != Refusal::none)
            continue;
        if (is_excluded(ranking.machine(slot), request))
            entry.machine.refusal = Refusal::excluded;
        else if (!ranking.machine(slot).has_labels(request.labels))
            entry.machine.refusal = Refusal::labels;
        else if (request.must_fit && ranking.machine(slot).lacks_room(cost))
            entry.machine.refusal = Refusal::room;
    }
    if (!whole_fleet)
        return;
    // The others were ranked for this request: their scores are not those of the ranking.
    for (std::size_t position = 0; position != chosen_ones.size(); ++position) {
        Entry& entry = entries[chosen_ones[position].slot];
        entry.machine = ranking.machine(chosen_ones[position].slot).view();
        entry.machine.score = chosen_ones[position].score;
        entry.machine.warm = chosen_ones[position].warm;
        entry.position = position;
    }
}

void Record::note(std::size_t position, Candidate const& machine) noexcept
{
    if (whole_fleet)
        return;
    auto const used = std::span(entries).first(entry_count);
    bool const noted =
        std::ranges::any_of(used, [position](Entry const& entry) { return entry.position == position; });
    if (noted || entry_count == entries.size()) {
        complete = complete && noted;
        return;
    }
    entries[entry_count].machine = machine;
    entries[entry_count].position = position;
    ++entry_count;
}

Decision Record::decision() const
{
    Decision copy;
    copy.id = id;
    copy.at = at;
    copy.policy = policy->name;
    copy.chosen = chosen;
    copy.random = random;
    copy.unseen_arrivals = unseen_arrivals;
    copy.offered = offered;
    copy.refused = refused;
    copy.held = held;
    copy.expected_cost = expected_cost;
    copy.free_seats = free_seats;
    copy.complete = complete;
    for (Entry const& entry : std::span(entries).first(entry_count)) {
        Decision::Entry kept;
        kept.machine = entry.machine;
        kept.machine.address = {};
        kept.address = entry.machine.address;
        if (entry.position != no_position)
            kept.position = entry.position;
        copy.machines.push_back(std::move(kept));
    }
    copy.lowest.assign(lowest.begin(), lowest.begin() + static_cast<std::ptrdiff_t>(lowest_count));
    copy.least_committed = least_committed;
    copy.least_reported = least_reported;
    return copy;
}

Candidate LiveSnapshot::operator[](std::size_t position) const
{
    Candidate const& machine = ranking_.machine(ranking_.slot_at(position)).view();
    record_.note(position, machine);
    return machine;
}

std::size_t LiveSnapshot::least_committed() const
{
    std::size_t const position = ranking_.least_committed();
    record_.least_committed = position;
    record_.note(position, ranking_.machine(ranking_.slot_at(position)).view());
    return position;
}

std::size_t LiveSnapshot::least_reported() const
{
    std::size_t const position = ranking_.least_reported();
    record_.least_reported = position;
    record_.note(position, ranking_.machine(ranking_.slot_at(position)).view());
    return position;
}

std::size_t LiveSnapshot::lowest(std::span<std::size_t> positions, std::size_t parts, double where) const
{
    std::size_t const found = ranking_.lowest(positions, parts, where);
    std::ranges::copy(positions.first(found), record_.lowest.begin());
    record_.lowest_count = found;
    return found;
}

Decision::Entry const* RecordedSnapshot::find(std::size_t position) const noexcept
{
    auto const found =
        std::ranges::find(decision_.machines, std::optional(position), &Decision::Entry::position);
    return found == decision_.machines.end() ? nullptr : &*found;
}

Candidate RecordedSnapshot::operator[](std::size_t position) const
{
    Decision::Entry const* const entry = find(position);
    missed_ = missed_ || entry == nullptr;
    Candidate machine = entry ? entry->machine : Candidate();
    if (entry)
        machine.address = entry->address;
    return machine;
}

std::size_t RecordedSnapshot::least_committed() const
{
    missed_ = missed_ || !decision_.least_committed;
    return decision_.least_committed.value_or(0);
}

std::size_t RecordedSnapshot::least_reported() const
{
    missed_ = missed_ || !decision_.least_reported;
    return decision_.least_reported.value_or(0);
}

std::size_t RecordedSnapshot::lowest(std::span<std::size_t> positions, std::size_t, double) const
{
    std::size_t const found = std::min(positions.size(), decision_.lowest.size());
    std::copy_n(decision_.lowest.begin(), found, positions.begin());
    return found;
}

} // namespace webots_cloud::placement
