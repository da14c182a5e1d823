#include "site_state.hpp"

namespace webots_cloud::core {

/// What is best for the visitor counts: of one machine that is down and one that is full, the full one.
SiteState site_state(SiteFacts const& facts) noexcept
{
    auto const count = [&](Refusal refusal) { return facts.machines[static_cast<std::size_t>(refusal)]; };
    bool const has_room = count(Refusal::none) > 0;
    if (!depends_on_machines(facts) || (facts.is_available && has_room))
        return facts.waiting == 0 ? SiteState::free : SiteState::busy;
    if (has_room) // what is free is reserved
        return SiteState::full;
    if (count(Refusal::load) + count(Refusal::committed) + count(Refusal::memory) > 0)
        return SiteState::busy;
    if (count(Refusal::full) > 0)
        return SiteState::full;
    if (facts.is_awaited)
        return SiteState::unknown;
    return count(Refusal::draining) > 0 ? SiteState::draining : SiteState::down;
}

SiteState machine_state(Refusal refusal, bool is_awaited) noexcept
{
    SiteFacts alone;
    alone.machines[static_cast<std::size_t>(refusal)] = 1;
    alone.is_available = refusal == Refusal::none;
    alone.can_wait = true;
    alone.is_awaited = is_awaited;
    return site_state(alone);
}

std::string_view word_of(SiteState state) noexcept
{
    switch (state) {
    case SiteState::unknown:
        return "unknown";
    case SiteState::free:
        return "free";
    case SiteState::busy:
        return "busy";
    case SiteState::full:
        return "full";
    case SiteState::draining:
        return "draining";
    case SiteState::down:
        return "down";
    }
    return {};
}

std::string_view sentence_of(SiteState state) noexcept
{
    switch (state) {
    case SiteState::unknown:
        return "It is not known whether a machine is free.";
    case SiteState::free:
        return "A machine is free.";
    case SiteState::busy:
        return "The machines are busy: a start may have to wait.";
    case SiteState::full:
        return "Every seat is taken.";
    case SiteState::draining:
        return "No machine takes new simulations at the moment.";
    case SiteState::down:
        return "No machine is running.";
    }
    return {};
}

} // namespace webots_cloud::core
