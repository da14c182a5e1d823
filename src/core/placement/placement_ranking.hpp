// All machines, and the indexes that make choosing among them cheap.
#pragma once

#include "placement_index.hpp"
#include "placement_machine.hpp"

#include <list>
#include <string>
#include <unordered_map>
#include <vector>

namespace webots_cloud::placement {

/// Keeps every machine's assessment, and indexes of the machines that are offered, by score and by load, and
/// of those that are not, with the reason.
///
/// Machines are numbered by slot: up to `numbered_in_order` of them in the order of the list, more of them in
/// the order in which they came, while the last one takes the number of one that leaves.
class Ranking
{
public:
    static constexpr std::size_t numbered_in_order = 64;

    explicit Ranking(SchedulerParams const& params);

    /// A new machine, or a known one as the entry says from now on; as Fleet::put. `name` owns the address
    /// and outlives its use here.
    void put(ServerSpec const& spec, std::string_view name, std::optional<std::string_view> before);
    void remove(std::string_view server);

    /// To be called when parameters have changed.
    void reassess() { rebuild(); }

    /// False, as of the next one: it is not in the list.
    bool report(std::string_view server, LoadReport const& report, TimePoint now);
    bool mark_unreachable(std::string_view server, TimePoint now);
    void place(std::size_t slot, ExpectedCost const& cost, TimePoint now) noexcept;
    /// Takes back what was placed at `placed_at`.
    void release(std::string_view server, TimePoint placed_at, TimePoint now) noexcept;
    /// How many sessions were given to a server in all, also of servers that left the list; 0 once forgotten.
    std::uint64_t placed(std::string_view server) const;
    /// Withdraws machines whose reports have become too old. Amortised O(1).
    void expire(TimePoint now) noexcept;

    std::size_t size() const noexcept { return by_slot_.size(); }
    Machine const& machine(std::size_t slot) const noexcept { return *by_slot_[slot]; }
    bool lists(std::string_view server) const { return slots_.contains(server); }
    /// In the order of the list.
    std::list<Machine> const& machines() const noexcept { return machines_; }
    std::array<std::size_t, refusal_count> const& refused() const noexcept { return refused_; }
    /// The same by Machine::obstacle().
    std::array<std::size_t, refusal_count> const& obstacles() const noexcept { return obstacles_; }
    Refusal obstacle_of(std::string_view server, std::vector<std::string> const& labels) const noexcept;
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
    /// The first positions, this many, have room, those after them up to usable() are overcommitted.
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
        Refusal obstacle = Refusal::unknown; ///< As counted, too.
    };

    /// A server that left the list, and may come back.
    struct Departed
    {
        std::string name;
        std::uint64_t placed = 0;
    };

    void add(ServerSpec const& spec, std::string_view name, std::list<Machine>::iterator place);
    void number_in_order();
    void rebuild();
    void renumber(std::uint32_t from, std::uint32_t to);
    void remember(Machine const& machine);
    std::uint64_t placed_before(std::string_view server);
    void assess(std::size_t slot, TimePoint now) noexcept;
    void offer(std::uint32_t slot, bool roomy) noexcept;
    void withdraw(std::uint32_t slot) noexcept;
    void exchange(std::uint32_t slot, std::size_t position) noexcept;
    void unlink(std::uint32_t slot) noexcept;
    void link_newest(std::uint32_t slot) noexcept;

    SchedulerParams const& params_;
    std::list<Machine> machines_;
    std::vector<std::list<Machine>::iterator> by_slot_;
    std::vector<Place> places_; ///< By slot.
    std::unordered_map<std::string_view, std::uint32_t> slots_;
    std::list<Departed> departed_; ///< The one that left last is the last.
    std::unordered_map<std::string_view, std::list<Departed>::iterator> departed_by_name_;
    std::size_t most_listed_ = 0;

    std::vector<std::uint32_t> usable_; ///< Not refused: first those with room, then the overcommitted.
    std::size_t roomy_ = 0;
    TournamentTree by_score_;
    TournamentTree by_load_;
    std::array<std::size_t, refusal_count> refused_{};
    std::array<std::size_t, refusal_count> obstacles_{};
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
