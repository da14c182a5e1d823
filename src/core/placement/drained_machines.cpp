#include "drained_machines.hpp"

#include "core/text.hpp"

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

void DrainedMachines::list(std::vector<ServerSpec> servers)
{
    servers_ = std::move(servers);
    places_.clear();
    for (std::size_t i = 0; i < servers_.size(); ++i)
        places_.try_emplace(servers_[i].address, i);
    std::erase_if(drained_, [this](std::string const& address) { return !find(address); });
}

ServerSpec const* DrainedMachines::find(std::string_view address) const
{
    auto const found = places_.find(address);
    return found == places_.end() ? nullptr : &servers_[found->second];
}

DrainedMachines::Outcome DrainedMachines::obey(DrainOrder const& order)
{
    auto const* const server = find(order.machine);
    if (!server)
        return Outcome::unknown;
    if (!order.off) {
        drained_.insert(order.machine);
        return Outcome::done;
    }
    drained_.erase(order.machine);
    return server->drain ? Outcome::configured : Outcome::done;
}

std::vector<ServerSpec> DrainedMachines::servers() const
{
    auto servers = servers_;
    for (auto& server : servers)
        server.drain = server.drain || drained_.contains(server.address);
    return servers;
}

std::string_view DrainedMachines::drained_by(std::string_view address) const
{
    if (drained_.contains(address))
        return "operator";
    auto const* const server = find(address);
    return server && server->drain ? "configuration" : "";
}

} // namespace webots_cloud::placement
