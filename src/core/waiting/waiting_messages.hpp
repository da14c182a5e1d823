// What a browser that waits is told.
#pragma once

#include "wait_estimate.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// `queue:3`, for every browser.
std::string queue_message(std::size_t ahead);

/// `loading: 3 are ahead of you; the wait is about 1 to 4 minutes.`, for browsers that can't say it
/// themselves. The range is rounded here.
std::string waiting_sentence(std::size_t ahead, std::optional<WaitRange> const& wait);

/// `waiting: 3 60 240`, in seconds, or `waiting: 3 - -`, for those that can. The range is rounded here.
std::string waiting_message(std::size_t ahead, std::optional<WaitRange> const& wait);

/// `waitingTicket: <ticket>`.
std::string waiting_ticket_message(std::string_view ticket);

/// `loading: A machine is free.`
std::string turn_message();

} // namespace webots_cloud::core
