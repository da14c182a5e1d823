// Simulations that are ready before anybody asks: which one is staged next, which ones are given back.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// A world of which simulations are to be ready.
struct StagedWorld
{
    StagedWorld() = default;

    std::string url;     ///< As it was configured.
    std::string address; ///< The same of however many links to it.
    std::string mode;
    int count = 0;
};

/// What this machine has for staged simulations.
struct StagingRoom
{
    StagingRoom() = default;

    int seats = 0;               ///< Of the machine.
    int taken = 0;               ///< By browsers.
    double load = 0;             ///< Percent, without what staged simulations use.
    double browsers = 0;         ///< Percent, of the simulations of browsers alone.
    double memory = 0;           ///< Percent that is used, by staged simulations too.
    bool browser_starts = false; ///< A simulation of a browser is being started.
    bool is_open = true;         ///< The server neither drains nor stops.
};

/// Knows the staged simulations, and decides. Simulations of browsers always come first: one seat stays free
/// for them, nothing is staged while one of them starts, and staged ones are given back as soon as browsers
/// need their seats or their memory.
class Staging
{
public:
    using Id = std::uint64_t;

    static constexpr double busy_load = 70;
    /// Between two that are staged where the machine is busy: simulations may keep it so all day.
    static constexpr auto busy_pause = std::chrono::seconds(10);
    /// By browsers: nothing more is staged, since their simulations need the rest. Without this limit users
    /// of a busy campus spend 2 % more of their time on machines that are over-full (theory_test).
    static constexpr double full_load = 85;
    static constexpr double much_memory = 75; ///< Nothing more is staged.
    static constexpr double no_memory = 90;   ///< One after the other is given back.
    /// After a failure; then twice as long after each.
    static constexpr auto shortest_pause = std::chrono::seconds(1);
    static constexpr auto longest_pause = std::chrono::minutes(5);

    struct Plan
    {
        std::vector<Id> give_back;
        std::optional<std::size_t> next; ///< Of this world one is to be staged, by its number in `worlds`.
    };

    /// The most important ones first. Staged simulations of worlds that are not in the list are given back.
    void apply(std::vector<StagedWorld> worlds, Duration max_age);

    std::vector<StagedWorld> const& worlds() const noexcept { return worlds_; }

    Plan plan(TimePoint now, StagingRoom const& room) const;

    // What became of it. All but `begun` ignore simulations that are not known.
    void begun(Id id, std::size_t world, TimePoint now);
    void fetched(Id id, std::string revision);
    void ready(Id id, TimePoint now);
    void given_back(Id id);
    void taken(Id id); ///< A browser has it now.
    void ended(Id id, TimePoint now);

    /// The project of the world is in this version now: what was staged of others is old.
    void learned(std::string const& address, std::string const& revision);

    /// The one that a browser gets that starts this world; absent: there is none.
    std::optional<Id> find(std::string const& address, std::string const& mode) const;

    /// How many browsers could have now.
    int ready_for(std::string const& address, std::string const& mode) const;

    /// Nothing is to be done, ever, until `apply`.
    bool is_idle() const noexcept { return worlds_.empty() && staged_.empty(); }

    /// Staged simulations that have a seat: those that are not ready yet or are being ended, too.
    std::size_t seats() const noexcept { return staged_.size(); }

private:
    using World = std::pair<std::string, bool>; ///< Its address, and whether it sends pictures.

    static World world_of(StagedWorld const& world);

    enum class Stage
    {
        preparing,
        ready,
        leaving ///< It was given back, and is being ended.
    };

    struct Staged
    {
        World world;
        Stage stage = Stage::preparing;
        std::string revision; ///< Of its project; empty: not fetched yet.
        TimePoint since{};    ///< When it was ready.
        bool is_old = false;
    };

    struct Failures
    {
        unsigned count = 0;
        TimePoint pause_ends{};
    };

    /// By importance: the number of its world, and then its own.
    using Kept = std::vector<std::pair<std::size_t, Id>>;

    std::optional<std::size_t> find_world(World const& world) const;
    Kept keep(StagingRoom const& room, std::vector<Id>& give_back) const;
    std::optional<Id> one_to_retire(TimePoint now, StagingRoom const& room, Kept const& kept) const;
    std::optional<std::size_t> next(TimePoint now, StagingRoom const& room, Kept const& kept) const;
    bool is_any(Stage stage) const noexcept;

    std::vector<StagedWorld> worlds_;
    Duration max_age_{};
    std::map<Id, Staged> staged_;
    std::map<World, Failures> failures_;
    std::optional<TimePoint> last_begun_;
};

} // namespace webots_cloud::core
