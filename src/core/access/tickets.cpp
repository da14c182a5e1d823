#include "tickets.hpp"

#include "core/base64.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace webots_cloud::core {
namespace {

constexpr std::string_view purpose =
    "webots_cloud ticket 1\n"; // the secret may be used for other things, too
constexpr std::size_t expiry_size = 8;
constexpr std::size_t mac_size = 32;
constexpr std::size_t ticket_size = expiry_size + ticket_nonce_size + mac_size;
// Clocks of two machines differ. A ticket from further in the future would have to be remembered for long.
constexpr Duration max_clock_difference = std::chrono::minutes(5);

/// Milliseconds since 1970, the highest byte first: the order of the texts is that of the times.
std::string bytes_of(WallTime time)
{
    auto const milliseconds = static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count());
    std::string bytes;
    for (int shift = 56; shift >= 0; shift -= 8)
        bytes += static_cast<char>((milliseconds >> shift) & 0xff);
    return bytes;
}

} // namespace

std::string server_of_ticket(std::string_view address)
{
    auto name = lower_case(address);
    std::replace(name.begin(), name.end(), '/', ':');
    return name;
}

std::string make_ticket(Mac const& mac, std::string_view server, std::string_view nonce, WallTime now)
{
    auto const content =
        concat(bytes_of(now + std::chrono::duration_cast<WallTime::duration>(ticket_lifetime)), nonce);
    return base64url(concat(content, mac(concat(purpose, content, server_of_ticket(server)))));
}

std::string_view ticket_in(std::string_view path) noexcept
{
    constexpr std::string_view before = "/ticket/";
    if (!path.starts_with(before))
        return {};
    path.remove_prefix(before.size());
    auto const end = path.find('/');
    bool const is_known = end != std::string_view::npos &&
                          (path.substr(end) == "/client" || path.substr(end) == "/worlds/list");
    return is_known ? path.substr(0, end) : std::string_view();
}

std::optional<Failure> refusal(TicketVerdict verdict)
{
    switch (verdict) {
    case TicketVerdict::missing:
        return refused(Refused::no_ticket);
    case TicketVerdict::unknown:
        return refused(Refused::unknown_ticket);
    case TicketVerdict::expired:
        return refused(Refused::expired_ticket);
    case TicketVerdict::used:
        return refused(Refused::used_ticket);
    case TicketVerdict::too_many:
        return refused(Refused::too_many_tickets);
    case TicketVerdict::accepted:
        break;
    }
    return std::nullopt;
}

TicketBook::TicketBook(Mac mac, std::vector<std::string> names, std::size_t max_used)
    : mac_(std::move(mac)), max_used_(max_used)
{
    for (auto const& name : names)
        names_.push_back(server_of_ticket(name));
}

TicketVerdict TicketBook::redeem(std::string_view ticket, WallTime now)
{
    if (ticket.empty())
        return TicketVerdict::missing;
    auto const bytes = ticket.size() <= 2 * ticket_size ? base64url_bytes(ticket) : std::nullopt;
    if (!bytes || bytes->size() != ticket_size)
        return TicketVerdict::unknown;
    auto const content = std::string_view(*bytes).substr(0, expiry_size + ticket_nonce_size);
    auto const given = std::string_view(*bytes).substr(content.size());
    bool const is_ours = std::any_of(names_.begin(), names_.end(), [&](std::string const& name) {
        return equal_in_constant_time(given, mac_(concat(purpose, content, name)));
    });
    if (!is_ours)
        return TicketVerdict::unknown;
    auto const expiry = content.substr(0, expiry_size);
    auto const latest =
        now + std::chrono::duration_cast<WallTime::duration>(ticket_lifetime + max_clock_difference);
    if (expiry < bytes_of(now) || expiry > bytes_of(latest))
        return TicketVerdict::expired;
    // What has expired need not be remembered: its time refuses it. Before the count below, so that it takes
    // no place there.
    used_.erase(used_.begin(), used_.lower_bound(std::pair(bytes_of(now), std::string())));
    std::pair entry(std::string(expiry), std::string(content.substr(expiry_size)));
    if (used_.contains(entry))
        return TicketVerdict::used;
    // Full: refused, rather than forget a ticket that could then be used a second time.
    if (used_.size() >= max_used_)
        return TicketVerdict::too_many;
    used_.insert(std::move(entry));
    return TicketVerdict::accepted;
}

} // namespace webots_cloud::core
