// What a browser that waits is told.
#pragma once

#include "wait_estimate.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

struct PlaceInLine
{
    std::size_t ahead = 0;         ///< How many come before.
    std::optional<WaitRange> wait; ///< Not rounded; none: there is no estimate.
    bool wants_room = false;       ///< Machines are free, but have too little power left for its world.
};

/// `queue:3`, for every browser.
std::string queue_message(std::size_t ahead);

/// `loading: 3 are ahead of you; the wait is about 1 to 4 minutes.`, for browsers that can't say it
/// themselves.
std::string waiting_sentence(PlaceInLine const& place);

/// `waiting: 3 60 240`, in seconds, or `waiting: 3 - -`, for those that can; ` room` follows where the place
/// `wants_room`.
std::string waiting_message(PlaceInLine const& place);

/// `waitingTicket: <ticket>`.
std::string waiting_ticket_message(std::string_view ticket);

/// `loading: A machine is free.`
std::string turn_message();

} // namespace webots_cloud::core
