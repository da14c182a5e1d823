#include "machine_paths.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

constexpr std::string_view purpose_of_ids = "webots_cloud machine 1\n"; // the secret is used for tickets, too
constexpr std::size_t id_bytes = 12;                                    // two letters each

std::string_view id_in(std::string_view path)
{
    return path.substr(machine_folder.size());
}

} // namespace

std::string machine_id(Mac const& mac, std::string_view address)
{
    std::string id;
    for (char const byte : mac(concat(purpose_of_ids, address)).substr(0, id_bytes)) {
        auto const bits = static_cast<unsigned char>(byte);
        id += static_cast<char>('a' + (bits >> 4));
        id += static_cast<char>('a' + (bits & 0xf));
    }
    return id;
}

std::string machine_path(Mac const& mac, ServerSpec const& server)
{
    if (!mac || !server.has_own_path || !parse_internal_address(server.internal_address))
        return {};
    return concat(machine_folder, machine_id(mac, server.address));
}

std::optional<MachinePath> split_machine_path(std::string_view path) noexcept
{
    if (!path.starts_with(machine_folder))
        return std::nullopt;
    auto const end = std::min(path.size(), path.find('/', machine_folder.size()));
    MachinePath split;
    split.id = path.substr(machine_folder.size(), end - machine_folder.size());
    split.rest = end == path.size() ? std::string_view("/") : path.substr(end);
    return split.id.empty() ? std::nullopt : std::optional(split);
}

void MachinePaths::put(FleetMachine const& machine, FleetMachine const* was, std::optional<std::string_view>)
{
    if (machine.path.empty())
        return was ? remove(*was) : void();
    auto internal = parse_internal_address(machine.spec.internal_address).value();
    internal.name = machine.spec.internal_name;
    auto& known = machines_[machine.spec.address];
    known.known = &machine;
    known.answers = known.answers && known.internal == internal;
    known.internal = std::move(internal);
    by_id_.insert_or_assign(std::string(id_in(machine.path)), &known);
}

void MachinePaths::remove(FleetMachine const& machine)
{
    if (machine.path.empty())
        return;
    by_id_.erase(by_id_.find(id_in(machine.path)));
    machines_.erase(machines_.find(machine.spec.address));
}

void MachinePaths::answered(std::string_view address, bool as_ours)
{
    if (auto const found = machines_.find(address); found != machines_.end())
        found->second.answers = as_ours;
}

std::string_view MachinePaths::path_of(std::string_view address) const noexcept
{
    auto const found = machines_.find(address);
    return found == machines_.end() ? std::string_view() : found->second.known->path;
}

std::optional<MachinePaths::Found> MachinePaths::find(std::string_view path, std::string_view query) const
{
    auto const split = split_machine_path(path);
    auto const known = split ? by_id_.find(split->id) : by_id_.end();
    if (known == by_id_.end() || is_operators_path(split->rest))
        return std::nullopt;
    auto const& machine = *known->second;
    Found found;
    found.path = machine.known->path;
    if (!machine.answers)
        return found;
    found.target = target_at_machine(machine.internal, machine.known->spec.trusted, split->rest, query);
    found.target->is_elsewhere = machine.known->spec.elsewhere;
    return found;
}

} // namespace webots_cloud::core
