#include "site_addresses.hpp"

#include "core/public_place.hpp"
#include "core/text.hpp"

namespace webots_cloud::core {

std::string SiteAddresses::address_of(std::string_view machine, AskedAddress const& by) const
{
    if (auto const path = path_below_us(machine, by); !path.empty())
        return concat(own_base(by), path);
    if (!machine.starts_with(asked_name))
        return machine_reached_at(machine, own_, by);
    auto const path = path_in(machine);
    bool const is_where_asked = machine.substr(0, machine.size() - path.size()) == asked_name;
    bool const is_below_us =
        path.starts_with(machine_folder) || (config_.gateway && is_placed_by_proxy(own_, by));
    return is_where_asked && !path.empty() && is_below_us ? concat(own_base(by), path)
                                                          : machine_reached_at(machine, own_, by);
}

std::string SiteAddresses::address_below_us(std::string_view machine, AskedAddress const& by) const
{
    auto const path = path_below_us(machine, by);
    return path.empty() ? std::string() : concat(own_base(by), path);
}

std::string_view SiteAddresses::path_below_us(std::string_view machine, AskedAddress const& by) const
{
    auto path = paths_.empty() ? std::string_view() : paths_.path_of(machine);
    if (!path.empty() || !config_.gateway)
        return path;
    path = path_at_own_port(own_, machine);
    if (path.empty())
        path = path_behind_proxy(own_, other_names_, by, machine);
    auto const* const known = path.empty() ? nullptr : fleet_.find(machine);
    return known && !known->spec.internal_address.empty() ? path : std::string_view();
}

std::string SiteAddresses::path_unknown_to_machine(std::string_view path, AskedAddress const& by) const
{
    auto const split = split_port_path(path);
    if (!split)
        return {};
    auto const below_us = concat("/", std::to_string(split->port));
    if (is_placed_by_proxy(own_, by))
        return below_us;
    bool const is_at_own_port = !path_below_us(concat(own_.host, below_us), by).empty();
    return is_at_own_port ? below_us : std::string();
}

} // namespace webots_cloud::core
