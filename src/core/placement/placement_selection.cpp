// For requests that not every machine suits (labels, exclusions, costs, cached projects) all machines are
// looked at and ranked; the indexes of the Ranking serve the others.
#include "placement_selection.hpp"

#include <algorithm>

namespace webots_cloud::placement {

bool is_excluded(Machine const& machine, PlacementRequest const& request) noexcept
{
    return std::ranges::find(request.excluded, machine.address()) != request.excluded.end();
}

void Selection::select(Ranking const& ranking, PlacementRequest const& request,
                       ExpectedCost const& cost) noexcept
{
    entries_.clear();
    lacking_ = 0;
    excluded_ = 0;
    too_small_ = 0;
    bool has_roomy = false;
    for (std::size_t position = 0; position != ranking.usable(); ++position) {
        std::size_t const slot = ranking.slot_at(position);
        Machine const& machine = ranking.machine(slot);
        bool const is_wanted = !is_excluded(machine, request);
        bool const suits = machine.has_labels(request.labels);
        excluded_ += !is_wanted;
        lacking_ += is_wanted && !suits;
        bool const is_free = position < ranking.roomy() && !machine.lacks_memory(cost, ranking.params());
        bool const roomy = is_free && !(request.must_fit && machine.lacks_room(cost));
        too_small_ += is_wanted && suits && is_free && !roomy;
        if (!is_wanted || !suits || (!roomy && (has_roomy || request.only_free)))
            continue;
        // The first with room: those without it were kept only for the case that there is none.
        if (roomy && !has_roomy)
            entries_.clear();
        has_roomy = roomy;
        add(machine, slot, cost);
    }
    // What others have placed unseen lies on all machines that are offered: on these, a part of it.
    double const part = ranking.offered() == 0
                            ? 0
                            : static_cast<double>(entries_.size()) / static_cast<double>(ranking.offered());
    unseen_arrivals_ = ranking.unseen_arrivals() * std::min(part, 1.0);
}

void Selection::add(Machine const& machine, std::size_t slot, ExpectedCost const& cost) noexcept
{
    Entry entry;
    entry.slot = static_cast<std::uint32_t>(slot);
    entry.score = cost.is_known ? machine.score(cost) : machine.view().score;
    entry.by_score = order_key(entry.score, machine.turn());
    entry.by_load = order_key(machine.view().load, machine.turn());
    entries_.push_back(entry); // reserved for all machines: never allocates
}

void Selection::prefer(Ranking const& ranking, std::uint32_t project, ExpectedCost const& cost) noexcept
{
    if (entries_.empty())
        return;
    double const best = std::ranges::min_element(entries_, {}, &Entry::score)->score;
    for (Entry& entry : entries_) {
        Machine const& machine = ranking.machine(entry.slot);
        double const score = entry.score - machine.preference(cost);
        if (score > best || !machine.has_project(project))
            continue;
        entry.warm = true;
        entry.score = std::max(score, 0.0);
        entry.by_score = order_key(entry.score, machine.turn());
    }
}

void Selection::believe_reports(Ranking const& ranking, TimePoint since) noexcept
{
    auto const first = best(1);
    if (!first.empty() && ranking.machine(first.front().slot).shows_arrivals_since(since))
        unseen_arrivals_ = 0;
}

std::span<Selection::Entry const> Selection::best(std::size_t count) noexcept
{
    count = std::min(count, entries_.size());
    std::ranges::partial_sort(entries_, entries_.begin() + static_cast<std::ptrdiff_t>(count), {},
                              &Entry::by_score);
    return entries().first(count);
}

bool can_ever_serve(Ranking const& ranking, PlacementRequest const& request) noexcept
{
    for (std::size_t slot = 0; slot != ranking.size(); ++slot)
        if (!ranking.machine(slot).is_known() || ranking.machine(slot).has_labels(request.labels))
            return true;
    return ranking.size() == 0;
}

Candidate SelectedSnapshot::view(std::size_t position) const noexcept
{
    Selection::Entry const& entry = selection_.entries()[position];
    Candidate machine = ranking_.machine(entry.slot).view();
    machine.score = entry.score;
    machine.warm = entry.warm;
    return machine;
}

Candidate SelectedSnapshot::operator[](std::size_t position) const
{
    Candidate const machine = view(position);
    record_.note(position, machine);
    return machine;
}

std::size_t SelectedSnapshot::least_committed() const
{
    auto const entries = selection_.entries();
    auto const first = std::ranges::min_element(entries, {}, &Selection::Entry::by_score);
    auto const position = static_cast<std::size_t>(first - entries.begin());
    record_.least_committed = position;
    record_.note(position, view(position));
    return position;
}

std::size_t SelectedSnapshot::least_reported() const
{
    auto const entries = selection_.entries();
    auto const first = std::ranges::min_element(entries, {}, &Selection::Entry::by_load);
    auto const position = static_cast<std::size_t>(first - entries.begin());
    record_.least_reported = position;
    record_.note(position, view(position));
    return position;
}

std::size_t SelectedSnapshot::lowest(std::span<std::size_t> positions, std::size_t parts, double where) const
{
    auto const entries = selection_.entries();
    std::size_t const length = (entries.size() + parts - 1) / parts;
    std::size_t const begin =
        std::min(static_cast<std::size_t>(where * static_cast<double>(parts)) * length, entries.size());
    std::size_t const end = std::min(begin + length, entries.size());
    auto const wanted = std::min(positions.size(), max_lowest);
    auto const score = [&](std::size_t position) { return entries[position].by_score; };
    // Few are wanted, so each finds its place among those that were the lowest so far.
    std::size_t found = 0;
    for (std::size_t position = begin; position != end; ++position) {
        auto const kept = positions.first(found);
        auto const place = std::ranges::upper_bound(kept, score(position), {}, score) - kept.begin();
        if (static_cast<std::size_t>(place) == wanted)
            continue;
        found = std::min(found + 1, wanted);
        auto const later =
            positions.subspan(static_cast<std::size_t>(place), found - static_cast<std::size_t>(place));
        std::shift_right(later.begin(), later.end(), 1);
        later.front() = position;
    }
    std::ranges::copy(positions.first(found), record_.lowest.begin());
    record_.lowest_count = found;
    return found;
}

} // namespace webots_cloud::placement
