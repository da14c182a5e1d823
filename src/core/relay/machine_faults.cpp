#include "machine_faults.hpp"

#include <algorithm>

namespace webots_cloud::core {

void MachineFaults::was_silent(std::string_view entry, TimePoint now)
{
    auto& faults = machines_[std::string(entry)];
    faults.pause = faults.pause == Duration::zero() ? first_pause : std::min(2 * faults.pause, longest_pause);
    faults.until = now + faults.pause;
}

void MachineFaults::has_refused(std::string_view entry, std::string_view group, std::string_view why)
{
    auto& faults = machines_[std::string(entry)];
    faults.last_refusal = why;
    bool const counts = !group.empty() && faults.groups < groups_refused &&
                        !faults.refused.full_level(group, 1, 1, groups_refused);
    if (!counts)
        return;
    faults.refused.add(group);
    ++faults.groups;
}

void MachineFaults::has_served(std::string_view entry)
{
    forget(entry);
}

void MachineFaults::forget(std::string_view entry)
{
    if (auto const found = machines_.find(entry); found != machines_.end())
        machines_.erase(found);
}

std::vector<std::string> MachineFaults::silent(TimePoint now) const
{
    std::vector<std::string> found;
    for (auto const& [entry, faults] : machines_)
        if (now < faults.until)
            found.push_back(entry);
    return found;
}

std::vector<std::string> MachineFaults::unwilling() const
{
    std::vector<std::string> found;
    for (auto const& [entry, faults] : machines_)
        if (faults.groups >= groups_refused)
            found.push_back(entry);
    return found;
}

std::string_view MachineFaults::last_refusal(std::string_view entry) const
{
    auto const found = machines_.find(entry);
    return found == machines_.end() ? std::string_view() : found->second.last_refusal;
}

} // namespace webots_cloud::core
