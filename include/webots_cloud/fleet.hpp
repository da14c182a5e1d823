// The simulation servers of a site: one list, in which they are added, changed, drained and removed.
// Scheduler, LoadMonitor, SessionService and AccessControl follow it, and so may parts of yours
// (FleetObserver).
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/server_spec.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What becomes different in a list of simulation servers.
struct ServerChange
{
    ServerChange() = default;

    enum class Kind : std::uint8_t
    {
        added,
        changed, ///< Its entry or its place in the list has changed.
        removed
    };

    Kind kind = Kind::added;
    /// From now on. Of one that is removed the address alone counts.
    ServerSpec server;
    /// It stands in front of this machine, by its address; empty: at the end.
    std::string before;
};

/// A machine of a Fleet.
struct FleetMachine
{
    FleetMachine() = default;

    ServerSpec spec;         ///< As it was configured or found.
    bool is_drained = false; ///< The operator has said so while the server runs: Fleet::drain.
    /// Below this path of the session server browsers reach it: `/machine/<id>`. Empty: it has none.
    std::string path;

    /// It gets no new sessions, whoever says so; but it may say so itself, too (`LoadReport::draining`).
    bool is_draining() const noexcept { return is_drained || spec.drain; }
    /// Who says so: `operator` or `configuration`; empty: nobody.
    std::string_view drained_by() const noexcept;

    bool operator==(FleetMachine const&) const = default;
};

class Fleet;

/// Is told of what changes in a Fleet, while it changes. It must not change the fleet meanwhile.
///
/// Of a machine that comes or changes, those who have followed the fleet longest are told first; of one that
/// leaves, they are told last. So an observer may rely on those who followed before it.
/// Lifetime: the fleet and its observers may end in any order.
class FleetObserver
{
public:
    FleetObserver() = default;
    FleetObserver(FleetObserver const&) = delete;
    FleetObserver& operator=(FleetObserver const&) = delete;
    virtual ~FleetObserver();

    /// A machine has come, or is another one than it `was` (null: it is new). It stands in front of the
    /// machine `before`; empty: at the end; nothing: where it was.
    /// Lifetime: `machine` is where it is until it has left the fleet; `was`, until put() returns.
    virtual void put(FleetMachine const& machine, FleetMachine const* was,
                     std::optional<std::string_view> before) = 0;
    /// It leaves the fleet.
    virtual void remove(FleetMachine const& machine) = 0;
    /// Nothing else changes for now: called once after one or many calls of put() and remove().
    virtual void settled() {}

private:
    friend class Fleet;
    Fleet* fleet_ = nullptr;
};

/// The machines of a site, in the operator's order, and what is known of each but its load: how it is
/// configured or was found, whether the operator drains it, and its path. What polls tell is kept by the
/// LoadMonitor; what the Scheduler has learned, by it.
///
/// Thread-safety: distinct objects: safe. One object, with its observers: one thread at a time.
class Fleet
{
public:
    /// `mac` makes the ids in the paths of machines (HMAC-SHA256, with a secret that is the same after a
    /// restart, and at all session servers of a site). Empty: no machine has a path of its own
    /// (`ServerSpec::has_own_path`).
    explicit Fleet(std::function<std::string(std::string_view message)> mac = {});
    ~Fleet();

    /// These are its machines from now on: new ones are added, those missing are removed, the others take
    /// the new entry, and stay drained if the operator drained them. Of entries with one address the first
    /// counts.
    void set(std::vector<ServerSpec> const& servers);

    /// What becomes different, one after the other. It costs what it changes.
    void change(std::vector<ServerChange> const& changes);

    /// A single machine: a new one is added, a known one is what the entry says from now on. It stands in
    /// front of the machine `before`, or at the end where that is not in the list. By default new ones come
    /// to the end, and known ones stay where they are.
    void put(ServerSpec const& server, std::optional<std::string_view> before = std::nullopt);

    /// It leaves the list; the operator's word that it is drained goes with it.
    void remove(std::string_view address);

    /// The operator drains a machine, or takes that back; it ends as well when the machine leaves the list.
    /// Nothing is sent to it, so this works with machines of every kind. False: it is not in the list.
    bool drain(std::string_view address, bool is_drained);

    /// In the order of the list.
    /// Lifetime: a machine is where it is until it leaves the list.
    std::list<FleetMachine> const& machines() const noexcept;

    /// One of them. Null: it is not in the list.
    /// Lifetime: as of machines().
    FleetMachine const* find(std::string_view address) const;

    /// How many the operator drains.
    std::size_t drained() const noexcept;

    /// Tells it of all machines at once, and from now on of what changes. Does nothing if it follows this
    /// fleet already; another fleet that it has followed tells it nothing more.
    void add_observer(FleetObserver& observer);

    /// It is told nothing more.
    void remove_observer(FleetObserver& observer) noexcept;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
