// The line of the browsers that wait for a seat.
#pragma once

#include "core/access/quota_counts.hpp"

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <unordered_map>

namespace webots_cloud::core {

struct WaitingRoomParams
{
    std::size_t places = 1000; ///< 0: nobody may wait.
    /// How much later whoever belongs to a group counts as having come, for each seat that the group has or
    /// waits for. Not negative.
    Duration seat_penalty = std::chrono::seconds(10);
    Duration max_penalty = std::chrono::minutes(5); ///< Not negative.
};

/// First come, first served, but a group that has or wants many seats comes later: a browser's rank is
///
///     arrival + min(max_penalty, seat_penalty * (seats that its group has + others of it who wait))
///
/// or that of the last one of its group who waits, if that is later, so that a group is served in the order
/// of arrival; the lowest rank is first, the lowest id among equals. A rank never changes once it is given.
/// So nobody is ever overtaken by somebody who came more than `max_penalty` later; and since any group may
/// have only a part of the places, nobody can fill the room alone. Ranks are moments of the calendar, to
/// outlive a restart: where the calendar is set back by t, the bound is `max_penalty` + t for those who
/// waited then.
///
/// From VirtualClock (L. Zhang, SIGCOMM 1990) and Start-time Fair Queueing (P. Goyal, H. Vin, H. Cheng,
/// SIGCOMM 1996) comes the idea to stamp each arrival with a time that lies the further ahead the more its
/// flow has asked for, and to serve in the order of stamps; here the distance is bounded and forgets what the
/// group no longer has, so a group is delayed, but neither starved nor punished later.
///
/// A group that is an IPv6 network also counts as part of the wider networks that it is in (`QuotaLevels`).
class WaitingRoom
{
public:
    using Id = std::uint64_t;

    /// Who waits, or may, as queueing theory calls it: part of what the caller knows of a browser, so that
    /// nothing has to be looked up. Must stay where it is while it is in the line.
    class Customer
    {
    public:
        explicit Customer(Id number) : id(number) {}

        Customer(Customer const&) = delete;
        Customer& operator=(Customer const&) = delete;

        // None of them changes while it is in the line, unless the room changes it.
        Id id;
        WallTime rank{};   ///< Before `WaitingRoom::enter`: when it came.
        std::string group; ///< Whose seats count together (the client's quota key, its class, or a name for
                           ///< one of these); empty: they count with nobody's.

    protected:
        ~Customer() = default;

    private:
        friend class WaitingRoom;

        bool is_in_line_ = false;
    };

    enum class Verdict
    {
        waits,
        full,      ///< All places are taken.
        group_full ///< The group has all that one may have: `group_places`.
    };

    WaitingRoom() = default;
    explicit WaitingRoom(WaitingRoomParams params) : params_(params) {}

    /// Joins the line, and is given its rank.   `held`: how many seats its group has now.
    /// Precondition: it is not in the line.
    Verdict enter(Customer& customer, std::size_t held);

    /// Joins with its rank, that of a ticket, also when the room is full: it had a place.   Precondition: it
    /// is not in the line.
    Verdict return_to(Customer& customer);

    /// Back with its rank after a turn that led nowhere, whatever the limits.   Precondition: it is not in
    /// the line.
    void put_back(Customer& customer);

    /// False: it was not in the line.
    bool leave(Customer& customer);

    std::size_t size() const noexcept { return line_.size(); }

    /// The one with that many ahead.   Precondition: less than `size()`.
    Customer& at(std::size_t ahead) const { return *line_[ahead]; }

    /// How many are ahead.   Precondition: it is in the line.
    std::size_t ahead_of(Customer const& customer) const;

    /// How many of a group wait; or its share of those of a wider network, if that is more.
    std::size_t size_of(std::string const& group) const { return counts_.of(group); }
    bool is_full() const noexcept { return line_.size() >= params_.places; }

    /// How many of a group may wait: a quarter of the places, at least 40, or all where there are fewer.
    /// Wider networks have more (`allowance`).
    std::size_t group_places() const noexcept;

    WaitingRoomParams const& params() const noexcept { return params_; }

    /// Those who wait keep place and rank, even where there are now fewer places.
    void apply(WaitingRoomParams params) { params_ = params; }

private:
    using Line = std::deque<Customer*>;

    bool has_room_for(std::string const& group);
    Line::const_iterator place_of(Customer const& customer) const;

    WaitingRoomParams params_;
    Line line_; ///< Sorted. Most come at its end and leave at its beginning.
    QuotaCounts counts_;
    /// The latest rank of those of a group who wait, or have waited since one of them did.
    std::unordered_map<std::string, WallTime> last_ranks_;
};

} // namespace webots_cloud::core
