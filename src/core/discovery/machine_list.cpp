#include "machine_list.hpp"

namespace webots_cloud::core {

void MachineList::name(std::size_t source, ServerSpec const& machine)
{
    machines_[machine.address].named.insert_or_assign(source, machine);
    touched_.insert(machine.address);
}

void MachineList::forget(std::size_t source, std::string_view address)
{
    auto const machine = machines_.find(address);
    if (machine != machines_.end() && machine->second.named.erase(source) != 0)
        touched_.emplace(address);
}

std::vector<ServerChange> MachineList::take(std::size_t machines)
{
    std::vector<ServerChange> changes;
    for (; machines != 0 && !touched_.empty(); --machines) {
        auto const touched = touched_.extract(touched_.begin());
        if (auto change = update(machines_.find(touched.value())))
            changes.push_back(std::move(*change));
    }
    return changes;
}

std::optional<ServerChange> MachineList::update(Machines::iterator machine)
{
    auto& [address, facts] = *machine;
    auto const before = std::exchange(facts.source, std::nullopt);
    if (before)
        order_.erase({*before, address});
    ServerChange change;
    if (facts.named.empty()) {
        change.kind = ServerChange::Kind::removed;
        change.server.address = address;
        machines_.erase(machine);
        return before ? std::optional(std::move(change)) : std::nullopt;
    }
    auto const& [source, treated] = *facts.named.begin();
    facts.source = source;
    auto const next = std::next(order_.emplace(source, address).first);
    if (before == source && facts.listed == treated)
        return std::nullopt;
    facts.listed = treated;
    change.kind = before ? ServerChange::Kind::changed : ServerChange::Kind::added;
    change.server = treated;
    change.before = next == order_.end() ? std::string_view() : next->second;
    return change;
}

std::vector<ServerSpec> MachineList::servers() const
{
    std::vector<ServerSpec> servers;
    servers.reserve(order_.size());
    for (auto const& [source, address] : order_)
        servers.push_back(machines_.find(address)->second.listed);
    return servers;
}

} // namespace webots_cloud::core
