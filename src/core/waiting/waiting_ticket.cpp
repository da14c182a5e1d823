// A ticket is the place itself, signed: the server keeps no list over a restart. It names its group by a
// keyed hash, so that nobody learns addresses from it, and yet a place goes on counting for its network.
#include "waiting_ticket.hpp"

#include "core/access/ip_address.hpp"
#include "core/base64.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

using namespace std::chrono_literals;

// The secret is used for other things, too.
constexpr std::string_view ticket_purpose = "webots_cloud waiting ticket 1\n";
constexpr std::string_view group_purpose = "webots_cloud waiting group 1\n";
constexpr std::size_t group_size = 8; // a /64 network
constexpr std::size_t time_size = 8;
constexpr std::size_t content_size = WaitingId().size() + group_size + 2 * time_size;
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

/// The name of a group, from 8 bytes or more. Global unicast, as only that has levels.
std::string group_of(std::string_view bytes)
{
    IpAddress::Bytes network{};
    std::copy_n(bytes.begin(), group_size, network.begin());
    network[0] = static_cast<std::uint8_t>((network[0] & 0x1f) | 0x20);
    return IpAddress(network).quota_key();
}

/// None: zeros.
std::string bytes_of(std::string_view group)
{
    auto const network = IpAddress::parse(group.substr(0, group.find('/'))).value_or(IpAddress());
    return {network.bytes().begin(), network.bytes().begin() + group_size};
}

WallTime later(WallTime time, Duration by)
{
    return time + std::chrono::duration_cast<WallTime::duration>(by);
}

} // namespace

/// The key keeps what its networks have in common (as Crypto-PAn does: J. Fan, J. Xu, M. Ammar, S. Moon,
/// Computer Networks 2004): of the name, 6 bytes stand for the /48, and one each for the rest of /56 and /64.
std::string waiting_group(Mac const& mac, std::string_view key)
{
    QuotaLevels const levels(key);
    if (levels.size() == 0)
        return {};
    auto const pad = [&mac](QuotaLevel const& level) { return mac(concat(group_purpose, level.key)); };
    if (levels.size() == 1)
        return group_of(pad(*levels.begin()));
    auto const address = IpAddress::parse(key.substr(0, key.find('/')))->bytes();
    auto name = pad(levels.begin()[2]).substr(0, group_size);
    auto const hide = [&](std::size_t byte, char with) {
        name[byte] = static_cast<char>(static_cast<unsigned char>(with) ^ address[byte]);
    };
    hide(6, name[6]);
    hide(7, pad(levels.begin()[1]).front());
    return group_of(name);
}

std::string make_waiting_ticket(Mac const& mac, WaitingTicket const& ticket)
{
    auto const content = concat(std::string_view(ticket.id.data(), ticket.id.size()), bytes_of(ticket.group),
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
    if (auto const group = take(group_size); group != std::string(group_size, '\0'))
        ticket.group = group_of(group);
    ticket.rank = time_of(take(time_size));
    ticket.issued = time_of(take(time_size));
    // This program signed it, but perhaps long ago: who keeps an old ticket must not keep a place in the
    // queue with it.
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
    away_of_.add(found->second.group);
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
    return away_of_.of(group);
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
    away_of_.remove(found->second.group);
    away_order_.erase({found->second.until, id});
    away_.erase(found);
}

} // namespace webots_cloud::core
