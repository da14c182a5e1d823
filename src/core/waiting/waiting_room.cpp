#include "waiting_room.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::size_t least_group_places = 40; // a class behind one address

Duration penalty(WaitingRoomParams const& params, std::size_t seats)
{
    if (params.seat_penalty <= Duration::zero())
        return Duration::zero();
    auto const most = static_cast<std::size_t>(params.max_penalty / params.seat_penalty);
    return seats > most ? params.max_penalty : params.seat_penalty * static_cast<Duration::rep>(seats);
}

} // namespace

WaitingRoom::Verdict WaitingRoom::enter(Id id, std::string group, std::size_t held, WallTime arrived)
{
    auto const answer = verdict(group);
    if (answer == Verdict::waits) {
        auto const later = penalty(params_, held + size_of(group));
        auto rank = arrived + std::chrono::duration_cast<WallTime::duration>(later);
        if (auto const others = groups_.find(group); others != groups_.end())
            rank = std::max(rank, others->second.last);
        add(id, std::move(group), rank);
    }
    return answer;
}

WaitingRoom::Verdict WaitingRoom::return_to(Id id, std::string group, WallTime rank)
{
    if (size_of(group) >= group_places())
        return Verdict::group_full;
    add(id, std::move(group), rank);
    return Verdict::waits;
}

bool WaitingRoom::leave(Id id)
{
    auto const found = places_.find(id);
    if (found == places_.end())
        return false;
    line_.erase(in_line(found->second.rank, id));
    if (auto* const group = found->second.group; group && --group->second.waiting == 0)
        groups_.erase(groups_.find(group->first));
    places_.erase(found);
    return true;
}

std::optional<WaitingRoom::Id> WaitingRoom::first() const
{
    if (line_.empty())
        return std::nullopt;
    return line_.front().second;
}

void WaitingRoom::visit(std::function<bool(Id, std::size_t)> const& visitor) const
{
    std::size_t ahead = 0;
    for (auto const& [rank, id] : line_) {
        if (!visitor(id, ahead++))
            return;
    }
}

std::size_t WaitingRoom::ahead_of(Id id) const
{
    return static_cast<std::size_t>(in_line(rank(id), id) - line_.begin());
}

std::size_t WaitingRoom::size_of(std::string const& group) const
{
    auto const found = groups_.find(group);
    return found == groups_.end() ? 0 : found->second.waiting;
}

std::size_t WaitingRoom::group_places() const noexcept
{
    return std::max(params_.places / 4, std::min(params_.places, least_group_places));
}

WallTime WaitingRoom::rank(Id id) const
{
    return places_.at(id).rank;
}

WaitingRoom::Verdict WaitingRoom::verdict(std::string const& group) const
{
    if (is_full())
        return Verdict::full;
    return size_of(group) >= group_places() ? Verdict::group_full : Verdict::waits;
}

void WaitingRoom::add(Id id, std::string group, WallTime rank)
{
    Groups::value_type* counted = nullptr;
    if (!group.empty()) {
        counted = &*groups_.try_emplace(std::move(group)).first;
        ++counted->second.waiting;
        counted->second.last = std::max(counted->second.last, rank);
    }
    line_.emplace(in_line(rank, id), rank, id);
    places_.emplace(id, Place{rank, counted});
}

/// Where it is, or has to be.
WaitingRoom::Line::const_iterator WaitingRoom::in_line(WallTime rank, Id id) const
{
    return std::lower_bound(line_.begin(), line_.end(), std::pair(rank, id));
}

} // namespace webots_cloud::core
