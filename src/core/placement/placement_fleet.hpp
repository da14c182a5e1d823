// All machines, and the indexes that make choosing among them cheap.
#pragma once

#include "placement_index.hpp"
#include "placement_machine.hpp"

#include <deque>
#include <string>
#include <unordered_map>
#include <vector>

namespace webots_cloud::placement {

/// Keeps every machine's assessment, and indexes of the machines that are offered, by score and by load, and
/// of those that are not, with the reason.
///
/// Machines are numbered by slot, their place in the operator's list.
class Fleet
{
public:
    explicit Fleet(SchedulerParams const& params);

    /// `names` own the addresses and outlive their use here: one per entry of `specs`.
    void set_servers(std::vector<ServerSpec> const& specs, std::vector<std::string_view> const& names);

    /// To be called when parameters have changed.
    void reassess() { rebuild(); }

    void report(std::string_view server, LoadReport const& report, TimePoint now);
    void mark_unreachable(std::string_view server, TimePoint now);
    void place(std::size_t slot, ExpectedCost const& cost, TimePoint now) noexcept;
    /// Takes back what was placed at `placed_at`.
    void release(std::string_view server, TimePoint placed_at, TimePoint now) noexcept;
    /// How many sessions were given to a server in all, also of servers that left the list; 0 once forgotten.
    std::uint64_t placed(std::string_view server) const;
    /// Withdraws machines whose reports have become too old. Amortised O(1).
    void expire(TimePoint now) noexcept;

    std::size_t size() const noexcept { return machines_.size(); }
    Machine const& machine(std::size_t slot) const noexcept { return machines_[slot]; }
    std::array<std::size_t, refusal_count> const& refused() const noexcept { return refused_; }
    /// How many more sessions those offered have room for.
    std::size_t free_seats() const noexcept { return free_seats_; }
    /// Of a session of that world, relative to the average one.
    ExpectedCost expect(WorldKey const& key) const noexcept { return lessons_.worlds.expect(key); }
    double unseen_arrivals() const noexcept { return lessons_.foreign.unseen(); }
    bool has_others(TimePoint now) const noexcept { return lessons_.foreign.is_known(now); }
    WorldCosts const& worlds() const noexcept { return lessons_.worlds; }
    void replace_worlds(WorldCosts worlds) { lessons_.worlds = std::move(worlds); }
    /// A machine has reported projects.
    bool knows_projects() const noexcept { return knows_projects_; }
    SchedulerParams const& params() const noexcept { return params_; }

    // Those offered, by position: dense, in no order. Overcommitted machines only while there are no others.
    std::size_t offered() const noexcept { return roomy_ != 0 ? roomy_ : usable_.size(); }
    /// The first so many positions have room, those after them up to usable() are overcommitted.
    std::size_t roomy() const noexcept { return roomy_; }
    std::size_t usable() const noexcept { return usable_.size(); }
    std::size_t slot_at(std::size_t position) const noexcept { return usable_[position]; }
    std::size_t position_of(std::size_t slot) const noexcept { return places_[slot].position; }
    std::size_t least_committed() const noexcept { return position_of(by_score_.first()); }
    std::size_t least_reported() const noexcept { return position_of(by_load_.first()); }
    std::size_t lowest(std::span<std::size_t> positions, std::size_t parts, double where) const noexcept;

private:
    static constexpr std::uint32_t nowhere = std::numeric_limits<std::uint32_t>::max();

    /// What the indexes know of a machine: its position among those not refused, and its neighbours by age
    /// of report.
    struct Place
    {
        std::uint32_t position = nowhere;
        std::uint32_t older = nowhere;
        std::uint32_t newer = nowhere;
        std::uint32_t seats = 0; ///< Its part of `free_seats_`.
        Refusal counted = Refusal::unknown;
    };

    struct NameHash
    {
        using is_transparent = void;
        std::size_t operator()(std::string_view name) const noexcept
        {
            return std::hash<std::string_view>()(name);
        }
    };

    /// A server that left the list, and may come back.
    struct Departed
    {
        std::uint64_t placed = 0;
        std::uint64_t order = 0; ///< The last one to leave has the highest.
    };

    void rebuild();
    void forget_departed(std::size_t max);
    void assess(std::size_t slot, TimePoint now) noexcept;
    void offer(std::uint32_t slot, bool roomy) noexcept;
    void withdraw(std::uint32_t slot) noexcept;
    void exchange(std::uint32_t slot, std::size_t position) noexcept;
    void unlink(std::uint32_t slot) noexcept;
    void link_newest(std::uint32_t slot) noexcept;

    SchedulerParams const& params_;
    std::vector<Machine> machines_;
    std::vector<Place> places_;
    std::unordered_map<std::string_view, std::uint32_t, NameHash, std::equal_to<>> slots_;
    std::unordered_map<std::string, Departed> departed_;
    std::uint64_t departures_ = 0;

    std::vector<std::uint32_t> usable_; ///< Not refused: first those with room, then the overcommitted.
    std::size_t roomy_ = 0;
    TournamentTree by_score_;
    TournamentTree by_load_;
    std::array<std::size_t, refusal_count> refused_{};
    std::size_t free_seats_ = 0;
    std::uint32_t oldest_ = nowhere;
    std::uint32_t newest_ = nowhere;

    Lessons lessons_;
    RandomSource first_turns_;
    std::uint32_t turns_ = 0;
    std::optional<TimePoint> first_report_;
    bool knows_projects_ = false;
};

} // namespace webots_cloud::placement
