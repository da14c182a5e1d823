// Tickets of those who wait: whatever a browser sends, with or without a good code, only a ticket of now is
// read, and it says the same as before when it is made again.
#include "fuzz.hpp"

#include "core/waiting/waiting_ticket.hpp"

#include <string>

using namespace webots_cloud;
using namespace std::chrono_literals;

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    static core::Mac const guessed = [](std::string_view) { return std::string(32, 'x'); };
    static core::Mac const unknown = [](std::string_view) { return std::string(32, '\xa7'); };
    constexpr WallTime now{std::chrono::hours(400'000)};
    auto const text = fuzz::text_of(data, size);
    auto const ticket = core::read_waiting_ticket(guessed, text, now, 5min);
    if (!ticket)
        return 0;
    fuzz::require(ticket->group.empty() || core::QuotaLevels(ticket->group).size() == 3);
    fuzz::require(ticket->issued >= now - 80s && ticket->issued <= now + 5s);
    fuzz::require(ticket->rank >= now - 24h && ticket->rank <= now + 5min + 5s);
    auto again = core::make_waiting_ticket(guessed, *ticket);
    auto const own = core::read_waiting_ticket(guessed, again, now, 5min);
    fuzz::require(own && core::make_waiting_ticket(guessed, *own) == again);
    // Groups that an older version has named get three other bits, which are all in this character.
    constexpr std::size_t in_group = 21;
    again[in_group] = text[in_group];
    fuzz::require(again == text);
    fuzz::require(!core::read_waiting_ticket(unknown, text, now, 5min));
    return 0;
}
