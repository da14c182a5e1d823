// What a browser that waits is told.
#pragma once

#include "core/site_state.hpp"
#include "wait_estimate.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// For what somebody waits.
enum class WaitReason : std::uint8_t
{
    seat,     ///< One of those that are taken, or a moment.
    room,     ///< Machines are free, but have too little power left for its world.
    busy,     ///< Not every seat is taken, but no machine has power or memory left.
    suitable, ///< Machines are free, but not one that it may use.
    draining, ///< Machines answer, but none takes new simulations.
    down      ///< No machine answers.
};
inline constexpr std::array all_wait_reasons = {WaitReason::seat,     WaitReason::room,     WaitReason::busy,
                                                WaitReason::suitable, WaitReason::draining, WaitReason::down};
/// How many wait, for each reason.
using WaitCounts = std::array<std::size_t, all_wait_reasons.size()>;

/// `room`, as in messages and on the monitor.
std::string_view word_of(WaitReason why) noexcept;

/// `supply`: what the site were if nobody waited.   `wants_room`: the free machines have too little power
/// left for its world.   `is_choosy`: it needs labels, or machines have refused it.
WaitReason wait_reason(SiteState supply, bool wants_room, bool is_choosy) noexcept;

/// Whether the ends of sessions say when its turn comes.
constexpr bool ends_with_a_session(WaitReason why) noexcept
{
    return why == WaitReason::seat || why == WaitReason::suitable;
}

struct PlaceInLine
{
    std::size_t ahead = 0;         ///< How many come before.
    std::optional<WaitRange> wait; ///< Not rounded; none: there is no estimate.
    WaitReason why = WaitReason::seat;
};

/// `queue:3`, for every browser.
std::string queue_message(std::size_t ahead);

/// `loading: 3 are ahead of you; the wait is about 1 to 4 minutes.`, for browsers that can't say it
/// themselves.
std::string waiting_sentence(PlaceInLine const& place);

/// `waiting: 3 60 240`, in seconds, or `waiting: 3 - -`, for those that can; a word of the reason follows,
/// as in `waiting: 0 0 90 room`, unless it is a seat.
std::string waiting_message(PlaceInLine const& place);

/// `waitingTicket: <ticket>`.
std::string waiting_ticket_message(std::string_view ticket);

/// `loading: A machine is free.`
std::string turn_message();

} // namespace webots_cloud::core
