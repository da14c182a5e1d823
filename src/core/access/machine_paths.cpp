#include "machine_paths.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

constexpr std::string_view purpose_of_ids = "webots_cloud machine 1\n"; // the secret is used for tickets, too
constexpr std::size_t id_bytes = 12;                                    // two letters each

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

void MachinePaths::put(ServerSpec const& server)
{
    auto internal = parse_internal_address(server.internal_address);
    if (!mac_ || !server.has_own_path || !internal)
        return remove(server.address);
    internal->name = server.internal_name;
    auto const [known, is_new] = machines_.try_emplace(server.address);
    auto& machine = known->second;
    machine.answers = machine.answers && machine.internal == *internal;
    machine.internal = std::move(*internal);
    machine.is_trusted = server.trusted;
    if (is_new) {
        machine.path = concat(machine_folder, machine_id(mac_, server.address));
        ids_.emplace(std::string_view(machine.path).substr(machine_folder.size()), &machine);
    }
}

void MachinePaths::remove(std::string_view address)
{
    auto const found = machines_.find(address);
    if (found == machines_.end())
        return;
    ids_.erase(std::string_view(found->second.path).substr(machine_folder.size()));
    machines_.erase(found);
}

void MachinePaths::answered(std::string_view address, bool as_ours)
{
    if (auto const found = machines_.find(address); found != machines_.end())
        found->second.answers = as_ours;
}

std::string_view MachinePaths::path_of(std::string_view address) const noexcept
{
    auto const found = machines_.find(address);
    return found == machines_.end() ? std::string_view() : found->second.path;
}

std::optional<MachinePaths::Found> MachinePaths::find(std::string_view path, std::string_view query) const
{
    auto const split = split_machine_path(path);
    auto const known = split ? ids_.find(split->id) : ids_.end();
    if (known == ids_.end() || is_operators_path(split->rest))
        return std::nullopt;
    auto const& machine = *known->second;
    Found found;
    found.path = machine.path;
    if (!machine.answers)
        return found;
    found.target = target_at_machine(machine.internal, machine.is_trusted, split->rest, query);
    return found;
}

} // namespace webots_cloud::core
