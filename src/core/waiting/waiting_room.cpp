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
    auto const answer = verdict(customer.group);
    if (answer == Verdict::waits) {
        auto const later = penalty(params_, held + size_of(customer.group));
        customer.rank += std::chrono::duration_cast<WallTime::duration>(later);
        if (auto const others = groups_.find(customer.group); others != groups_.end())
            customer.rank = std::max(customer.rank, others->second.last);
        put_back(customer);
    }
    return answer;
}

WaitingRoom::Verdict WaitingRoom::return_to(Customer& customer)
{
    if (size_of(customer.group) >= group_places())
        return Verdict::group_full;
    put_back(customer);
    return Verdict::waits;
}

void WaitingRoom::put_back(Customer& customer)
{
    if (!customer.group.empty()) {
        auto& counted = *groups_.try_emplace(customer.group).first;
        ++counted.second.waiting;
        counted.second.last = std::max(counted.second.last, customer.rank);
        customer.counted_in_ = &counted;
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
    auto* const group = std::exchange(customer.counted_in_, nullptr);
    if (group && --group->second.waiting == 0)
        groups_.erase(groups_.find(group->first));
    return true;
}

std::size_t WaitingRoom::ahead_of(Customer const& customer) const
{
    return static_cast<std::size_t>(place_of(customer) - line_.begin());
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

WaitingRoom::Verdict WaitingRoom::verdict(std::string const& group) const
{
    if (is_full())
        return Verdict::full;
    return size_of(group) >= group_places() ? Verdict::group_full : Verdict::waits;
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
