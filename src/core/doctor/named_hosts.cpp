#include "named_hosts.hpp"

#include <functional>
#include <set>
#include <utility>

namespace webots_cloud::core {
namespace {

/// As far as it takes to tell it from a name.
bool is_numeric_host(std::string_view host) noexcept
{
    return host.find(':') != std::string_view::npos ||
           host.find_first_not_of("0123456789.") == std::string_view::npos;
}

class HostList
{
public:
    void add(std::string_view key, std::string_view address)
    {
        auto const name = host_in(address);
        if (!name.empty() && name != "*" && !is_numeric_host(name) && names_.emplace(name).second)
            hosts_.emplace_back(key, name);
    }

    std::vector<NamedHost> take() { return std::move(hosts_); }

private:
    std::vector<NamedHost> hosts_;
    std::set<std::string, std::less<>> names_;
};

} // namespace

std::string_view host_in(std::string_view address) noexcept
{
    if (auto const scheme = address.find("://"); scheme != std::string_view::npos)
        address.remove_prefix(scheme + 3);
    address = address.substr(0, address.find_first_of("/?#"));
    if (auto const at = address.rfind('@'); at != std::string_view::npos)
        address.remove_prefix(at + 1);
    if (address.starts_with('['))
        return address.substr(1, address.find(']') - 1);
    bool const has_port = address.find(':') == address.rfind(':');
    return has_port ? address.substr(0, address.find(':')) : address;
}

std::vector<NamedHost> named_hosts(SessionConfig const& config)
{
    HostList hosts;
    hosts.add("server", config.address.host);
    for (auto const& server : config.simulation_servers) {
        std::string_view const kind = std::string_view(server.address).substr(0, server.address.find(':'));
        if (kind != "dns" && kind != "srv" &&
            kind != "announced") // machines that are found are other checks'
            hosts.add("simulationServers",
                      server.internal_address.empty() ? server.address : server.internal_address);
    }
    if (!config.mail.administrator.empty())
        hosts.add("mailServer", config.mail.server);
    return hosts.take();
}

std::vector<NamedHost> named_hosts(SimulationConfig const& config)
{
    HostList hosts;
    hosts.add("server", config.address.host);
    for (auto const& forge : config.forges)
        if (forge.is_server())
            hosts.add("forges", forge.url);
    for (auto const& registry : config.service.notify)
        hosts.add("notify", registry);
    return hosts.take();
}

} // namespace webots_cloud::core
