// Tickets that keep a browser's place in the line while it has no connection, also over a restart.
#pragma once

#include "core/access/quota_counts.hpp"
#include "core/access/tickets.hpp"

#include <webots_cloud/time.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace webots_cloud::core {

/// Random bytes, the same in all tickets of one place in the line.
using WaitingId = std::array<char, 16>;
constexpr std::size_t waiting_ticket_size = 96; ///< Characters of the text.
/// How often who waits is sent a new ticket.
constexpr Duration waiting_ticket_interval = std::chrono::seconds(20);
/// How long one is usable after it was made: a minute after the last time that its browser was connected.
constexpr Duration waiting_ticket_lifetime = std::chrono::seconds(60) + waiting_ticket_interval;

struct WaitingTicket
{
    WaitingId id;
    std::string group; ///< `waiting_group`: the place goes on counting there, wherever its browser is now.
    WallTime rank;     ///< `WaitingRoom::rank`, to the nanosecond.
    WallTime issued;
};

/// Names a group (a client's quota key, a class) without telling which it is. The name of the group in
/// `WaitingRoom` and `WaitingTickets`, so that a browser that returns from another network counts where it
/// did. It has the form of an IPv6 network, /64, so that it counts on levels (`QuotaLevels`): names of
/// networks that are in the same /56 or /48 are so, too, and no others. The empty group stays empty.
std::string waiting_group(Mac const& mac, std::string_view key);

/// In base64url (RFC 4648, section 5).   Precondition: the group is a `waiting_group`.
std::string make_waiting_ticket(Mac const& mac, WaitingTicket const& ticket);

/// One of our tickets that may be used now, from any bytes; else nothing: one that is damaged or not ours,
/// was made more than `waiting_ticket_lifetime` ago, comes from the future (5 s are allowed to the clock, and
/// a rank may lie `max_penalty` ahead), or whose browser has waited for more than a day.
std::optional<WaitingTicket> read_waiting_ticket(Mac const& mac, std::string_view text, WallTime now,
                                                 Duration max_penalty);

/// Which tickets are in the room, and which must not come back: a place belongs to one connection at a time
/// and leads to one seat. It is not known any more after a restart: then a ticket whose browser has had its
/// seat for less than `waiting_ticket_lifetime` can be used once again.
class WaitingTickets
{
public:
    /// `max_remembered`: of those who were served, and of those who are away, so many each; the oldest is
    /// forgotten first.
    explicit WaitingTickets(std::size_t max_remembered = 10'000) : max_remembered_(max_remembered) {}

    /// False: who had it was served.
    bool is_usable(WaitingId const& id, WallTime now);

    /// The place now belongs to `connection`. Returns the one that it is taken from, if any.
    /// Precondition: `is_usable`.
    std::optional<std::uint64_t> enter(WaitingId const& id, std::string const& group,
                                       std::uint64_t connection);

    /// The connection is gone; its browser may come back. Nothing where the place was taken over.
    void leave(WaitingId const& id, std::uint64_t connection, WallTime now);

    /// It was its turn. Nothing where the place was taken over.
    void serve(WaitingId const& id, std::uint64_t connection, WallTime now);

    /// How many of the group have left, and may still come back with their rank. They count like those who
    /// wait, added to `held` of `WaitingRoom::enter`: else somebody could collect places without a penalty by
    /// leaving after each, and come back to all of them.
    std::size_t away(std::string const& group, WallTime now);

    /// All that are remembered.
    std::size_t size() const noexcept { return here_.size() + away_.size() + served_.size(); }

private:
    struct Here
    {
        std::string group;
        std::uint64_t connection;
    };
    struct Gone
    {
        std::string group;
        WallTime until;
    };
    /// Nobody can choose ids that collide: they are random, and come back only in tickets that we have
    /// signed.
    struct Hash
    {
        std::size_t operator()(WaitingId const& id) const noexcept
        {
            std::size_t beginning = 0;
            std::memcpy(&beginning, id.data(), sizeof beginning);
            return beginning;
        }
    };
    template<typename Value>
    using ById = std::unordered_map<WaitingId, Value, Hash>;
    using Order = std::set<std::pair<WallTime, WaitingId>>; // until when, and which

    void forget(WallTime now);
    void forget_away(WaitingId const& id);

    std::size_t max_remembered_;
    ById<Here> here_;
    ById<Gone> away_;
    ById<WallTime> served_;
    Order away_order_;
    Order served_order_;
    QuotaCounts away_of_; // groups
};

} // namespace webots_cloud::core
