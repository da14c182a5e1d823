// The line of the browsers that wait for a seat.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

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
/// have only so many of the places, nobody can fill the room alone. Ranks are moments of the calendar, to
/// outlive a restart: where the calendar is set back by t, the bound is `max_penalty` + t for those who
/// waited then.
///
/// From VirtualClock (L. Zhang, SIGCOMM 1990) and Start-time Fair Queueing (P. Goyal, H. Vin, H. Cheng,
/// SIGCOMM 1996) comes the idea to stamp each arrival with a time that lies the further ahead the more its
/// flow has asked for, and to serve in the order of stamps; here the distance is bounded and forgets what the
/// group no longer has, so a group is delayed, but neither starved nor punished later.
class WaitingRoom
{
public:
    using Id = std::uint64_t;

    enum class Verdict
    {
        waits,
        full,      ///< All places are taken.
        group_full ///< The group has all that one may have: `group_places`.
    };

    WaitingRoom() = default;
    explicit WaitingRoom(WaitingRoomParams params) : params_(params) {}

    /// Joins the line.   `group`: whose seats count together (the client's quota key, its class); empty: they
    /// count with nobody's.   `held`: how many seats the group has now.
    /// Precondition: `id` does not wait.
    Verdict enter(Id id, std::string group, std::size_t held, WallTime arrived);

    /// Joins with the rank of a ticket, also when the room is full: it had a place.   Precondition: `id` does
    /// not wait.
    Verdict return_to(Id id, std::string group, WallTime rank);

    /// Back after a turn that led nowhere, whatever the limits.   Precondition: `id` does not wait.
    void put_back(Id id, std::string group, WallTime rank) { add(id, std::move(group), rank); }

    /// False: `id` did not wait.
    bool leave(Id id);

    /// Whose turn it is.
    std::optional<Id> first() const;

    /// Calls `visitor` for everybody in the line, with the number of those who are ahead, until it returns
    /// false. It must not change the room.
    void visit(std::function<bool(Id, std::size_t ahead)> const& visitor) const;

    /// How many are ahead of `id`.   Precondition: it waits.
    std::size_t ahead_of(Id id) const;

    std::size_t size() const noexcept { return line_.size(); }
    std::size_t size_of(std::string const& group) const;
    bool is_full() const noexcept { return line_.size() >= params_.places; }

    /// How many of a group may wait: a quarter of the places, at least 40, or all where there are fewer.
    std::size_t group_places() const noexcept;

    /// Precondition: `id` waits.
    WallTime rank(Id id) const;

    WaitingRoomParams const& params() const noexcept { return params_; }

    /// Whoever waits keeps place and rank, even where there are now fewer places.
    void apply(WaitingRoomParams params) { params_ = params; }

private:
    struct Group
    {
        std::size_t waiting = 0;
        WallTime last{}; ///< The latest rank of those who wait, or have waited since one of them did.
    };
    using Groups = std::unordered_map<std::string, Group>;
    struct Place
    {
        WallTime rank;
        Groups::value_type* group; // elements of unordered maps stay where they are; null: no group
    };

    using Line = std::deque<std::pair<WallTime, Id>>;

    Verdict verdict(std::string const& group) const;
    void add(Id id, std::string group, WallTime rank);
    Line::const_iterator in_line(WallTime rank, Id id) const;

    WaitingRoomParams params_;
    Line line_; ///< Sorted. Most come at its end and leave at its beginning.
    std::unordered_map<Id, Place> places_;
    Groups groups_;
};

} // namespace webots_cloud::core
