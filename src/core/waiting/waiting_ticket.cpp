#include "waiting_ticket.hpp"

#include "core/base64.hpp"
#include "core/text.hpp"

namespace webots_cloud::core {
namespace {

using namespace std::chrono_literals;

// The secret is used for other things, too.
constexpr std::string_view ticket_purpose = "webots_cloud waiting ticket 1\n";
constexpr std::string_view group_purpose = "webots_cloud waiting group 1\n";
constexpr std::size_t time_size = 8;
constexpr std::size_t content_size = WaitingId().size() + waiting_group_size + 2 * time_size;
constexpr std::size_t mac_size = 32;
static_assert(waiting_ticket_size == (content_size + mac_size) / 3 * 4 && (content_size + mac_size) % 3 == 0);
constexpr Duration clock_tolerance = 5s;
constexpr Duration longest_wait = 24h;

std::string bytes_of(WallTime time)
{
    auto const count = static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count());
    std::string bytes;
    for (int shift = 56; shift >= 0; shift -= 8)
        bytes += static_cast<char>((count >> shift) & 0xff);
    return bytes;
}

WallTime time_of(std::string_view bytes)
{
    std::uint64_t count = 0;
    for (char const byte : bytes)
        count = (count << 8) | static_cast<unsigned char>(byte);
    return WallTime(std::chrono::duration_cast<WallTime::duration>(
        std::chrono::nanoseconds(static_cast<std::int64_t>(count))));
}

WallTime later(WallTime time, Duration by)
{
    return time + std::chrono::duration_cast<WallTime::duration>(by);
}

} // namespace

std::string waiting_group(Mac const& mac, std::string_view key)
{
    return key.empty() ? std::string() : mac(concat(group_purpose, key)).substr(0, waiting_group_size);
}

std::string make_waiting_ticket(Mac const& mac, WaitingTicket const& ticket)
{
    auto group = ticket.group;
    group.resize(waiting_group_size); // none: zeros
    auto const content = concat(std::string_view(ticket.id.data(), ticket.id.size()), group,
                                bytes_of(ticket.rank), bytes_of(ticket.issued));
    return base64url(concat(content, mac(concat(ticket_purpose, content))));
}

std::optional<WaitingTicket> read_waiting_ticket(Mac const& mac, std::string_view text, WallTime now,
                                                 Duration max_penalty)
{
    auto const bytes = text.size() == waiting_ticket_size ? base64url_bytes(text) : std::nullopt;
    if (!bytes)
        return std::nullopt;
    std::string_view rest = *bytes;
    auto const take = [&rest](std::size_t size) {
        auto const taken = rest.substr(0, size);
        rest.remove_prefix(size);
        return taken;
    };
    if (!equal_in_constant_time(rest.substr(content_size),
                                mac(concat(ticket_purpose, rest.substr(0, content_size)))))
        return std::nullopt;
    WaitingTicket ticket;
    take(ticket.id.size()).copy(ticket.id.data(), ticket.id.size());
    ticket.group = take(waiting_group_size);
    if (ticket.group == std::string(waiting_group_size, '\0'))
        ticket.group.clear();
    ticket.rank = time_of(take(time_size));
    ticket.issued = time_of(take(time_size));
    bool const is_of_now = ticket.issued >= later(now, -waiting_ticket_lifetime) &&
                           ticket.issued <= later(now, clock_tolerance) &&
                           ticket.rank >= later(now, -longest_wait) &&
                           ticket.rank <= later(now, max_penalty + clock_tolerance);
    return is_of_now ? std::optional(std::move(ticket)) : std::nullopt;
}

bool WaitingTickets::is_usable(WaitingId const& id, WallTime now)
{
    forget(now);
    return !served_.contains(id);
}

std::optional<std::uint64_t> WaitingTickets::enter(WaitingId const& id, std::string const& group,
                                                   std::uint64_t connection)
{
    forget_away(id);
    auto const [found, is_new] = here_.try_emplace(id, Here{group, connection});
    if (is_new)
        return std::nullopt;
    return std::exchange(found->second.connection, connection);
}

void WaitingTickets::leave(WaitingId const& id, std::uint64_t connection, WallTime now)
{
    forget(now);
    auto const found = here_.find(id);
    if (found == here_.end() || found->second.connection != connection)
        return;
    auto const until = later(now, waiting_ticket_lifetime);
    if (!found->second.group.empty())
        ++away_of_[found->second.group];
    away_.emplace(id, Gone{std::move(found->second.group), until});
    away_order_.emplace(until, id);
    here_.erase(found);
    if (away_.size() > max_remembered_)
        forget_away(WaitingId(away_order_.begin()->second));
}

void WaitingTickets::serve(WaitingId const& id, std::uint64_t connection, WallTime now)
{
    forget(now);
    auto const found = here_.find(id);
    if (found == here_.end() || found->second.connection != connection)
        return;
    here_.erase(found);
    auto const until = later(now, waiting_ticket_lifetime);
    served_.emplace(id, until);
    served_order_.emplace(until, id);
    if (served_.size() > max_remembered_) {
        served_.erase(served_order_.begin()->second);
        served_order_.erase(served_order_.begin());
    }
}

std::size_t WaitingTickets::away(std::string const& group, WallTime now)
{
    forget(now);
    auto const found = away_of_.find(group);
    return found == away_of_.end() ? 0 : found->second;
}

void WaitingTickets::forget(WallTime now)
{
    while (!away_order_.empty() && away_order_.begin()->first < now)
        forget_away(WaitingId(away_order_.begin()->second));
    while (!served_order_.empty() && served_order_.begin()->first < now) {
        served_.erase(served_order_.begin()->second);
        served_order_.erase(served_order_.begin());
    }
}

void WaitingTickets::forget_away(WaitingId const& id)
{
    auto const found = away_.find(id);
    if (found == away_.end())
        return;
    if (auto const group = away_of_.find(found->second.group);
        group != away_of_.end() && --group->second == 0)
        away_of_.erase(group);
    away_order_.erase({found->second.until, id});
    away_.erase(found);
}

} // namespace webots_cloud::core
