#include "drained_machines.hpp"

#include <utility>

namespace webots_cloud::placement {

std::optional<DrainOrder> parse_drain_order(std::string_view query)
{
    constexpr std::string_view machine = "machine=";
    DrainOrder order;
    for (auto const part : core::split(query, '&')) {
        if (part == "off" && !order.off)
            order.off = true;
        else if (!part.starts_with(machine) || !order.machine.empty() ||
                 !core::percent_decode(part.substr(machine.size()), order.machine))
            return std::nullopt;
    }
    if (order.machine.empty())
        return std::nullopt;
    return order;
}

void DrainedMachines::put(ServerSpec server)
{
    auto& known = servers_[server.address];
    known = std::move(server);
}

void DrainedMachines::remove(std::string_view address)
{
    if (auto const found = servers_.find(address); found != servers_.end())
        servers_.erase(found);
    if (auto const drained = drained_.find(address); drained != drained_.end())
        drained_.erase(drained);
}

bool DrainedMachines::lists(ServerSpec const& server) const
{
    auto const known = servers_.find(server.address);
    return known != servers_.end() && known->second == server;
}

DrainedMachines::Outcome DrainedMachines::obey(DrainOrder const& order)
{
    auto const server = servers_.find(order.machine);
    if (server == servers_.end())
        return Outcome::unknown;
    if (!order.off) {
        drained_.insert(order.machine);
        return Outcome::done;
    }
    drained_.erase(order.machine);
    return server->second.drain ? Outcome::configured : Outcome::done;
}

ServerSpec DrainedMachines::treated(std::string_view address) const
{
    auto server = servers_.find(address)->second;
    server.drain = server.drain || drained_.contains(address);
    return server;
}

std::string_view DrainedMachines::drained_by(std::string_view address) const
{
    if (drained_.contains(address))
        return "operator";
    auto const server = servers_.find(address);
    return server != servers_.end() && server->second.drain ? "configuration" : "";
}

} // namespace webots_cloud::placement
