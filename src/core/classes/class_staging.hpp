// Simulations that are ready before the students of classes ask: how many each machine is to have.
#pragma once

#include "core/simulation/staging_messages.hpp"

#include <webots_cloud/time.hpp>

#include <map>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// A machine that would have simulations ready for classes.
struct StagingMachine
{
    StagingMachine() = default;
    StagingMachine(std::string address, int room) : address(std::move(address)), room(room) {}

    std::string address;
    int room = 0; ///< So many at most.
};

/// Shares the seats that classes have not used yet among the machines, and keeps what those say. A share that
/// a machine has stays with it, so that what is ready is not given back only to be made elsewhere.
class ClassStaging
{
public:
    /// A seat that was given to a student is wanted no longer, although the student's page has not reached
    /// its machine yet: so long nothing is given back for that.
    static constexpr Duration patience = std::chrono::seconds(10);

    /// Of each class, those opened first first; machines that are not in the list have lost what they had.
    void update(std::vector<StagingWish> const& classes, std::vector<StagingMachine> const& machines,
                TimePoint now);

    /// What a machine has said.
    void heard(std::string const& machine, std::vector<StagedFigure> const& figures);

    /// The connection to a machine has ended: it has nothing ready, and counts anew.
    void lost(std::string const& machine);

    /// What a machine is to be told.
    std::vector<StagingWish> wishes_for(std::string const& machine) const;

    /// How many are ready for each class of the last update. Empty: no machine stages any.
    std::vector<int> ready() const;

private:
    using World = std::pair<std::string, std::string>; ///< Its address and mode.

    struct Share
    {
        int wanted = 0;
        int ready = 0;
        int taken = 0; ///< As the machine says.
    };

    /// What a machine is to have ready, by world.
    using Shares = std::map<World, Share>;

    struct Machine
    {
        int room = 0;
        Shares shares;

        int wanted() const;
    };

    void forget_worlds();
    void clip(Machine& machine);
    void reduce(World const& world, int by);
    void add(World const& world, int count);
    int shared(World const& world) const;

    std::vector<StagingWish> classes_;
    std::vector<World> worlds_; ///< Of the classes, each once.
    std::map<std::string, Machine> machines_;
    std::map<World, std::pair<int, TimePoint>> surplus_; ///< So many are wanted no longer, and since when.
};

} // namespace webots_cloud::core
