// A machine that has simulations ready before anybody asks: the decisions are the server's own.
#pragma once

#include "core/simulation/staging.hpp"

#include <string>
#include <vector>

namespace simulation {

constexpr double staging_takes = 5; // s, of a world that is loaded; meanwhile it wants what its sessions want

class StagedMachine
{
public:
    /// So many of each world, the most important ones first.
    StagedMachine(std::vector<std::string> const& worlds, int of_each);

    /// To be called once a second. `taken`: seats that browsers have; `load`: percent.
    void live(double now, int seats, int taken, double load, bool browser_starts);

    /// A browser starts this world: whether one was ready, which it has now. `is_last`: it was for this seat
    /// of a class, and is not made again.
    bool take(std::string const& world, bool is_last);

    /// How many are being started.
    int starting(double now) const;

    /// The machine has died.
    void die();

    std::size_t seats() const noexcept { return staging_.seats(); }

private:
    struct Start
    {
        webots_cloud::core::Staging::Id id = 0;
        double from = 0;
        double until = 0;
    };

    std::vector<webots_cloud::core::StagedWorld> worlds_;
    webots_cloud::core::Staging staging_;
    std::vector<Start> starts_; ///< Those of the last seconds, too.
    webots_cloud::core::Staging::Id last_ = 0;
};

} // namespace simulation
