// Chooses by what the machine has left. Browsers come first: nothing is staged while one starts.
#include "staging.hpp"

#include "launch_plan.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

/// One seat stays free: a browser that starts another world does not wait until a staged one has ended.
std::size_t seats_for_staging(StagingRoom const& room)
{
    return static_cast<std::size_t>(std::max(0, room.seats - room.taken - 1));
}

} // namespace

Staging::World Staging::world_of(StagedWorld const& world)
{
    return {world.address, is_video(world.mode)};
}

void Staging::apply(std::vector<StagedWorld> worlds, Duration max_age)
{
    worlds_ = std::move(worlds);
    max_age_ = max_age;
    std::erase_if(failures_, [this](auto const& entry) { return !find_world(entry.first); });
}

std::optional<std::size_t> Staging::find_world(World const& world) const
{
    auto const found = std::find_if(worlds_.begin(), worlds_.end(),
                                    [&](StagedWorld const& listed) { return world_of(listed) == world; });
    return found == worlds_.end() ? std::nullopt : std::optional<std::size_t>(found - worlds_.begin());
}

bool Staging::is_any(Stage stage) const noexcept
{
    return std::any_of(staged_.begin(), staged_.end(),
                       [&](auto const& entry) { return entry.second.stage == stage; });
}

/// Those that are wanted and have a seat; the others are to be given back.
Staging::Kept Staging::keep(StagingRoom const& room, std::vector<Id>& give_back) const
{
    Kept wanted;
    for (auto const& [id, staged] : staged_) {
        if (staged.stage == Stage::leaving)
            continue;
        auto const world = find_world(staged.world);
        if (room.is_open && world && !staged.is_old)
            wanted.emplace_back(*world, id);
        else
            give_back.push_back(id);
    }
    std::sort(wanted.begin(), wanted.end());
    Kept kept;
    std::map<std::size_t, int> counts;
    for (auto const& [world, id] : wanted) {
        if (kept.size() < seats_for_staging(room) && ++counts[world] <= worlds_[world].count)
            kept.emplace_back(world, id);
        else
            give_back.push_back(id);
    }
    return kept;
}

/// One after the other, so that some of those that are too old stay while the first is replaced.
std::optional<Staging::Id> Staging::one_to_retire(TimePoint now, StagingRoom const& room,
                                                  Kept const& kept) const
{
    if (kept.empty() || is_any(Stage::leaving))
        return std::nullopt;
    if (room.memory >= no_memory)
        return kept.back().second;
    if (is_any(Stage::preparing))
        return std::nullopt;
    for (auto const& [world, id] : kept)
        if (now - staged_.at(id).since >= max_age_)
            return id;
    return std::nullopt;
}

std::optional<std::size_t> Staging::next(TimePoint now, StagingRoom const& room, Kept const& kept) const
{
    bool const has_room = room.is_open && staged_.size() < seats_for_staging(room);
    bool const is_free = !room.browser_starts && room.memory < much_memory && !is_any(Stage::preparing);
    bool const is_its_turn = room.load < busy_load || !last_begun_ || now - *last_begun_ >= busy_pause;
    if (!has_room || !is_free || !is_its_turn || room.browsers >= full_load)
        return std::nullopt;
    std::optional<std::size_t> best;
    unsigned fewest = 0; // failures: those that fail do not hold up those behind them
    for (std::size_t world = 0; world < worlds_.size(); ++world) {
        auto const& wanted = worlds_[world];
        auto const found = failures_.find(world_of(wanted));
        auto const failures = found == failures_.end() ? Failures() : found->second;
        auto const there =
            std::count_if(kept.begin(), kept.end(), [&](auto const& entry) { return entry.first == world; });
        bool const is_due = now >= failures.pause_ends && there < wanted.count;
        if (is_due && (!best || failures.count < fewest)) {
            best = world;
            fewest = failures.count;
        }
    }
    return best;
}

Staging::Plan Staging::plan(TimePoint now, StagingRoom const& room) const
{
    Plan plan;
    auto const kept = keep(room, plan.give_back);
    if (!plan.give_back.empty())
        return plan;
    if (auto const old = one_to_retire(now, room, kept))
        plan.give_back.push_back(*old);
    else
        plan.next = next(now, room, kept);
    return plan;
}

void Staging::begun(Id id, std::size_t world, TimePoint now)
{
    last_begun_ = now;
    staged_[id].world = world_of(worlds_.at(world));
}

void Staging::fetched(Id id, std::string revision)
{
    if (auto const found = staged_.find(id); found != staged_.end())
        found->second.revision = std::move(revision);
}

void Staging::ready(Id id, TimePoint now)
{
    auto const found = staged_.find(id);
    if (found == staged_.end() || found->second.stage != Stage::preparing)
        return;
    found->second.stage = Stage::ready;
    found->second.since = now;
}

void Staging::given_back(Id id)
{
    auto const found = staged_.find(id);
    if (found == staged_.end())
        return;
    if (found->second.stage == Stage::ready)
        failures_.erase(found->second.world);
    found->second.stage = Stage::leaving;
}

void Staging::taken(Id id)
{
    auto const found = staged_.find(id);
    if (found == staged_.end())
        return;
    failures_.erase(found->second.world);
    staged_.erase(found);
}

void Staging::ended(Id id, TimePoint now)
{
    auto const found = staged_.find(id);
    if (found == staged_.end())
        return;
    auto const [world, stage] = std::pair(found->second.world, found->second.stage);
    staged_.erase(found);
    if (stage == Stage::leaving || !find_world(world))
        return;
    auto& failures = failures_[world];
    constexpr unsigned most_doublings = 16; // no overflow; longest_pause is reached before
    auto const pause = shortest_pause * (1 << std::min(failures.count++, most_doublings));
    failures.pause_ends = now + std::min<Duration>(pause, longest_pause);
}

void Staging::learned(std::string const& address, std::string const& revision)
{
    for (auto& [id, staged] : staged_)
        if (staged.world.first == address && !staged.revision.empty() && staged.revision != revision)
            staged.is_old = true;
}

std::optional<Staging::Id> Staging::find(std::string const& address, std::string const& mode) const
{
    World const world(address, is_video(mode));
    for (auto const& [id, staged] : staged_)
        if (staged.stage == Stage::ready && !staged.is_old && staged.world == world && is_known_mode(mode))
            return id;
    return std::nullopt;
}

int Staging::ready_for(std::string const& address, std::string const& mode) const
{
    World const world(address, is_video(mode));
    return static_cast<int>(std::count_if(staged_.begin(), staged_.end(), [&world](auto const& entry) {
        auto const& staged = entry.second;
        return staged.stage == Stage::ready && !staged.is_old && staged.world == world;
    }));
}

} // namespace webots_cloud::core
