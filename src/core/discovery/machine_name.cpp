#include "machine_name.hpp"

#include "core/access/forwarding.hpp"
#include "core/access/public_networks.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

constexpr std::string_view by_address = "dns:";
constexpr std::string_view by_service = "srv:";
constexpr std::size_t max_name = 253;

/// Letters, digits, `-` and `_` between dots; a dot at the end says that the search list is not for it.
bool is_dns_name(std::string_view name)
{
    if (name.ends_with('.'))
        name.remove_suffix(1);
    if (name.empty() || name.size() > max_name)
        return false;
    auto const labels = split(name, '.');
    return std::all_of(labels.begin(), labels.end(), [](std::string_view label) {
        constexpr std::size_t max_label = 63;
        auto const is_plain = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                   c == '_';
        };
        return !label.empty() && label.size() <= max_label &&
               std::all_of(label.begin(), label.end(), is_plain);
    });
}

} // namespace

bool is_machine_name(std::string_view entry) noexcept
{
    return entry.starts_with(by_address) || entry.starts_with(by_service);
}

std::optional<MachineName> parse_machine_name(std::string_view entry)
{
    MachineName machine;
    machine.is_service = entry.starts_with(by_service);
    if (!is_machine_name(entry))
        return std::nullopt;
    entry.remove_prefix(by_address.size());
    if (!machine.is_service) {
        auto const colon = entry.rfind(':');
        if (colon == std::string_view::npos)
            return std::nullopt;
        machine.port = parse_port(entry.substr(colon + 1));
        if (machine.port == 0)
            return std::nullopt;
        entry = entry.substr(0, colon);
    }
    machine.name = entry;
    return is_dns_name(machine.name) ? std::optional(std::move(machine)) : std::nullopt;
}

bool stands_for_found(std::string_view entry) noexcept
{
    return entry == announced_entry || is_machine_name(entry);
}

std::optional<WayInside> parse_way_inside(std::string_view text)
{
    constexpr std::string_view with_name = "https://";
    WayInside way;
    way.tls = text == "https" || text.starts_with(with_name);
    if (text == "http" || text == "https")
        return way;
    if (!way.tls)
        return std::nullopt;
    way.name = lower_case(text.substr(with_name.size()));
    return is_dns_name(way.name) ? std::optional(way) : std::nullopt;
}

bool reach_inside(ServerSpec& machine, std::optional<MachineName> const& name)
{
    if (machine.internal_address.empty())
        return true;
    auto const way = parse_way_inside(std::exchange(machine.internal_address, {}));
    auto address = machine.address; // announced ones may be `host/2000`
    std::replace(address.begin(), address.end(), '/', ':');
    if (!way || (!way->tls && !parse_numeric_address(address)))
        return false;
    machine.internal_address = way->tls ? concat("https://", address) : address;
    machine.internal_name = way->name;
    if (way->tls && way->name.empty() && name && !name->is_service)
        machine.internal_name = lower_case(name->name);
    if (machine.internal_name.ends_with('.'))
        machine.internal_name.pop_back();
    machine.has_own_path = parse_internal_address(machine.internal_address).has_value();
    return machine.has_own_path;
}

std::string machine_at(IpAddress const& address, std::uint16_t port)
{
    auto const host = address.is_v4() ? address.text() : concat("[", address.text(), "]");
    return concat(host, ":", std::to_string(port));
}

bool is_machine_address(IpAddress const& address, bool loopback)
{
    // Of NAT64 of one's own (RFC 8215), only its network knows what it leads to.
    static IpNetworks const never(
        {"0.0.0.0/8", "169.254.0.0/16", "224.0.0.0/3", "::/96", "64:ff9b:1::/48", "fe80::/10", "ff00::/8"});
    static IpNetworks const own({"127.0.0.0/8", "::1/128"});
    if (own.contains(address))
        return loopback;
    if (auto const v4 = ipv4_behind(address))
        return is_machine_address(*v4, loopback);
    return !never.contains(address);
}

bool is_machine_host(std::string_view host, bool loopback)
{
    if (host.starts_with('[') && host.ends_with(']'))
        host = host.substr(1, host.size() - 2);
    if (auto const address = IpAddress::parse(host))
        return is_machine_address(*address, loopback);
    auto name = lower_case(host);
    if (name.ends_with('.'))
        name.pop_back();
    return loopback || (name != "localhost" && !name.ends_with(".localhost"));
}

} // namespace webots_cloud::core
