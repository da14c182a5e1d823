#include "waiting_room.hpp"

#include <algorithm>
#include <utility>

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

WaitingRoom::Verdict WaitingRoom::enter(Customer& customer, std::size_t held)
{
    if (is_full())
        return Verdict::full;
    if (!has_room_for(customer.group))
        return Verdict::group_full;
    auto const later = penalty(params_, held + size_of(customer.group));
    customer.rank += std::chrono::duration_cast<WallTime::duration>(later);
    if (auto const last = last_ranks_.find(customer.group); last != last_ranks_.end())
        customer.rank = std::max(customer.rank, last->second);
    put_back(customer);
    return Verdict::waits;
}

WaitingRoom::Verdict WaitingRoom::return_to(Customer& customer)
{
    if (!has_room_for(customer.group))
        return Verdict::group_full;
    put_back(customer);
    return Verdict::waits;
}

void WaitingRoom::put_back(Customer& customer)
{
    if (!customer.group.empty()) {
        counts_.add(customer.group);
        auto& last = last_ranks_.try_emplace(customer.group, customer.rank).first->second;
        last = std::max(last, customer.rank);
    }
    line_.insert(place_of(customer), &customer);
    customer.is_in_line_ = true;
}

bool WaitingRoom::leave(Customer& customer)
{
    if (!customer.is_in_line_)
        return false;
    line_.erase(place_of(customer));
    customer.is_in_line_ = false;
    counts_.remove(customer.group);
    if (!counts_.has_any(customer.group))
        last_ranks_.erase(customer.group);
    return true;
}

std::size_t WaitingRoom::ahead_of(Customer const& customer) const
{
    return static_cast<std::size_t>(place_of(customer) - line_.begin());
}

std::size_t WaitingRoom::group_places() const noexcept
{
    return std::max(params_.places / 4, std::min(params_.places, least_group_places));
}

bool WaitingRoom::has_room_for(std::string const& group)
{
    return !counts_.full_level(group, 1, group_places(), params_.places);
}

/// Where it is, or has to be.
WaitingRoom::Line::const_iterator WaitingRoom::place_of(Customer const& customer) const
{
    auto const comes_before = [](Customer const* one, Customer const* other) {
        return std::pair(one->rank, one->id) < std::pair(other->rank, other->id);
    };
    return std::lower_bound(line_.begin(), line_.end(), &customer, comes_before);
}

} // namespace webots_cloud::core
