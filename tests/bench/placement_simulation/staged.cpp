#include "staged.hpp"

#include <algorithm>

namespace simulation {

using namespace webots_cloud;

namespace {

constexpr double remembered = 10; // s: longer than a report looks back

TimePoint second(double now)
{
    return TimePoint(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(3600 + now)));
}

} // namespace

StagedMachine::StagedMachine(std::vector<std::string> const& worlds, int of_each)
{
    for (std::string const& address : worlds) {
        core::StagedWorld world;
        world.url = world.address = address;
        world.mode = "mjpeg";
        world.count = of_each;
        worlds_.push_back(std::move(world));
    }
    staging_.apply(worlds_, std::chrono::minutes(10));
}

void StagedMachine::live(double now, int seats, int taken, double load, bool browser_starts)
{
    for (Start const& start : starts_)
        if (start.until <= now)
            staging_.ready(start.id, second(now));
    std::erase_if(starts_, [now](Start const& start) { return start.until + remembered < now; });
    core::StagingRoom room;
    room.seats = seats;
    room.taken = taken;
    room.load = room.browsers = load;
    room.browser_starts = browser_starts;
    auto const plan = staging_.plan(second(now), room);
    for (auto const id : plan.give_back) {
        staging_.given_back(id);
        staging_.ended(id, second(now));
        for (Start& start : starts_)
            if (start.id == id)
                start.until = std::min(start.until, now);
    }
    if (!plan.next)
        return;
    staging_.begun(++last_, *plan.next, second(now));
    staging_.fetched(last_, "commit");
    starts_.push_back({last_, now, now + staging_takes});
}

bool StagedMachine::take(std::string const& world, bool is_last)
{
    auto const id = staging_.find(world, "mjpeg");
    if (!id)
        return false;
    staging_.taken(*id);
    auto const known = std::ranges::find(worlds_, world, &core::StagedWorld::address);
    known->count -= is_last;
    staging_.apply(worlds_, std::chrono::minutes(10));
    return true;
}

int StagedMachine::starting(double now) const
{
    return static_cast<int>(std::ranges::count_if(
        starts_, [now](Start const& start) { return start.from <= now && now < start.until; }));
}

void StagedMachine::die()
{
    staging_ = core::Staging();
    staging_.apply(worlds_, std::chrono::minutes(10));
    starts_.clear();
}

} // namespace simulation
