// Shares what classes wish for among the machines, where most is free, as browsers are placed.
#include "class_staging.hpp"

#include <algorithm>
#include <numeric>

namespace webots_cloud::core {

int ClassStaging::Machine::wanted() const
{
    return std::accumulate(shares.begin(), shares.end(), 0,
                           [](int sum, auto const& entry) { return sum + entry.second.wanted; });
}

void ClassStaging::update(std::vector<StagingWish> const& classes,
                          std::vector<StagingMachine> const& machines, TimePoint now)
{
    classes_ = classes;
    worlds_.clear();
    std::map<World, int> wanted;
    for (auto const& wish : classes_) {
        World const world(wish.url, wish.mode);
        if (std::find(worlds_.begin(), worlds_.end(), world) == worlds_.end())
            worlds_.push_back(world);
        wanted[world] += wish.count;
    }
    // Machines keep their shares from one update to the next: what is being made ready there is not to be
    // moved.
    std::map<std::string, Machine> there;
    for (auto const& machine : machines) {
        auto& kept = there[machine.address];
        if (auto const known = machines_.find(machine.address); known != machines_.end())
            kept = std::move(known->second);
        kept.room = machine.room;
    }
    machines_ = std::move(there);
    forget_worlds();
    for (auto& [address, machine] : machines_)
        clip(machine);
    // What lacks is added at once. What is too much is taken back only when it has been so for a while:
    // students come and go.
    for (auto const& world : worlds_) {
        int const surplus = shared(world) - wanted[world];
        if (surplus <= 0) {
            surplus_.erase(world);
            add(world, -surplus);
            continue;
        }
        auto const since = surplus_.try_emplace(world, surplus, now).first;
        if (surplus > since->second.first)
            since->second = {surplus, now};
        else if (now - since->second.second >= patience)
            reduce(world, surplus);
    }
}

/// Of classes that have ended, or have another world now.
void ClassStaging::forget_worlds()
{
    auto const is_gone = [this](auto const& entry) {
        return std::find(worlds_.begin(), worlds_.end(), entry.first) == worlds_.end();
    };
    std::erase_if(surplus_, is_gone);
    for (auto& [address, machine] : machines_)
        std::erase_if(machine.shares, is_gone);
}

/// A machine that others fill has less room than it had: that of the last worlds is taken.
void ClassStaging::clip(Machine& machine)
{
    int excess = machine.wanted() - machine.room;
    for (auto world = worlds_.rbegin(); world != worlds_.rend() && excess > 0; ++world) {
        auto const share = machine.shares.find(*world);
        if (share == machine.shares.end())
            continue;
        int const less = std::min(excess, share->second.wanted);
        share->second.wanted -= less;
        excess -= less;
    }
}

int ClassStaging::shared(World const& world) const
{
    int sum = 0;
    for (auto const& [address, machine] : machines_)
        if (auto const share = machine.shares.find(world); share != machine.shares.end())
            sum += share->second.wanted;
    return sum;
}

/// One after the other where most is free, as browsers are placed.
void ClassStaging::add(World const& world, int count)
{
    auto const free = [](auto const& entry) { return entry.second.room - entry.second.wanted(); };
    for (; count > 0 && !machines_.empty(); --count) {
        auto const most = std::max_element(machines_.begin(), machines_.end(),
                                           [&](auto const& a, auto const& b) { return free(a) < free(b); });
        if (free(*most) <= 0)
            return;
        ++most->second.shares[world].wanted;
    }
}

/// First what is not ready yet, then where most are.
void ClassStaging::reduce(World const& world, int by)
{
    for (; by > 0; --by) {
        Share* most = nullptr;
        auto const rank = [](Share const& share) {
            return std::pair(std::max(0, share.wanted - share.ready), share.wanted);
        };
        for (auto& [address, machine] : machines_)
            if (auto const share = machine.shares.find(world); share != machine.shares.end() &&
                                                               share->second.wanted > 0 &&
                                                               (!most || rank(share->second) > rank(*most)))
                most = &share->second;
        if (!most)
            return;
        --most->wanted;
    }
}

void ClassStaging::heard(std::string const& machine, std::vector<StagedFigure> const& figures)
{
    auto const found = machines_.find(machine);
    if (found == machines_.end())
        return;
    for (auto const& figure : figures) {
        auto const share = found->second.shares.find(World(figure.url, figure.mode));
        if (share == found->second.shares.end())
            continue;
        auto& known = share->second;
        if (figure.taken > known.taken)
            known.wanted = std::max(0, known.wanted - (figure.taken - known.taken));
        known.taken = figure.taken;
        known.ready = figure.ready;
    }
}

void ClassStaging::lost(std::string const& machine)
{
    if (auto const found = machines_.find(machine); found != machines_.end())
        for (auto& [world, share] : found->second.shares)
            share.ready = share.taken = 0;
}

std::vector<StagingWish> ClassStaging::wishes_for(std::string const& machine) const
{
    std::vector<StagingWish> wishes;
    auto const found = machines_.find(machine);
    if (found == machines_.end())
        return wishes;
    for (auto const& world : worlds_) {
        auto const share = found->second.shares.find(world);
        if (share == found->second.shares.end() || share->second.wanted == 0)
            continue;
        auto& wish = wishes.emplace_back();
        std::tie(wish.url, wish.mode) = world;
        wish.count = share->second.wanted;
    }
    return wishes;
}

std::vector<int> ClassStaging::ready() const
{
    std::map<World, int> left;
    bool is_any = false;
    for (auto const& [address, machine] : machines_)
        for (auto const& [world, share] : machine.shares) {
            left[world] += std::min(share.ready, share.wanted);
            is_any = is_any || share.wanted > 0;
        }
    std::vector<int> ready;
    if (!is_any)
        return ready;
    for (auto const& wish : classes_) {
        auto& of_world = left[World(wish.url, wish.mode)];
        ready.push_back(std::min(of_world, wish.count));
        of_world -= ready.back();
    }
    return ready;
}

} // namespace webots_cloud::core
