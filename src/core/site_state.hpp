// What a site is for somebody who comes now: the one decision behind the lamp, the line, classes, the monitor
// and /metrics. docs/visitors.md has it as a table.
#pragma once

#include <webots_cloud/scheduler.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace webots_cloud::core {

enum class SiteState : std::uint8_t
{
    unknown,  ///< No machine has reported yet, but some have not been asked in vain either.
    free,     ///< A start finds a machine at once.
    busy,     ///< Not every seat is taken, but a start may wait for room.
    full,     ///< Every seat is taken, or reserved for a class.
    draining, ///< Machines answer, but none takes new simulations.
    down      ///< No machine answers, or there is none.
};
inline constexpr std::array all_site_states = {SiteState::unknown, SiteState::free,     SiteState::busy,
                                               SiteState::full,    SiteState::draining, SiteState::down};

struct SiteFacts
{
    SiteFacts() = default;

    /// Machines, for each `Refusal`: as of Scheduler::refusals().
    std::array<std::size_t, refusal_count> machines{};
    bool is_available = false; ///< Scheduler::available().
    bool can_wait = false;     ///< A machine that placements fill which nobody has claimed yet is not chosen.
    bool is_awaited = false;   ///< The first poll of some machine has not ended yet.
    std::size_t waiting = 0;   ///< In the line.
};

/// Whether the machines and `is_awaited` count. Otherwise they can be left out, as counting thousands takes
/// long.
constexpr bool depends_on_machines(SiteFacts const& facts) noexcept
{
    return !facts.is_available || facts.can_wait;
}

SiteState site_state(SiteFacts const& facts) noexcept;

/// What keeps sessions from a machine, in the same words.
SiteState machine_state(Refusal refusal, bool is_awaited) noexcept;

/// The word for programs: `free`, as in the WebSocket `/`, on the monitor, and in `/metrics`.
std::string_view word_of(SiteState state) noexcept;

/// The sentence for people, as in `site.free` of the pages' English texts.
std::string_view sentence_of(SiteState state) noexcept;

} // namespace webots_cloud::core
