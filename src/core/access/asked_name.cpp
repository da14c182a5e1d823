#include "asked_name.hpp"

#include "core/text.hpp"

#include <webots_cloud/transport/http.hpp>

#include <boost/url/authority_view.hpp>
#include <boost/url/parse.hpp>

#include <algorithm>
#include <cstdint>

namespace webots_cloud::core {
namespace {

enum class Port
{
    kept,
    dropped
};

std::string host_of(std::string_view header, Port port)
{
    auto const authority = boost::urls::parse_authority(header);
    if (!authority || authority->has_userinfo() || authority->encoded_host().empty())
        return "localhost";
    auto const host = port == Port::kept ? authority->encoded_host_and_port() : authority->encoded_host();
    return std::string(host.data(), host.size());
}

} // namespace

PublicAddress reached_at(PublicAddress address, std::string_view host)
{
    if (address.host == asked_name)
        address.host = host_of(host, address.port_rewrite ? Port::kept : Port::dropped);
    return address;
}

std::string machine_reached_at(std::string_view machine, std::string_view host)
{
    if (!machine.starts_with(asked_name))
        return std::string(machine);
    machine.remove_prefix(asked_name.size());
    return concat(host_of(host, machine.starts_with('/') ? Port::kept : Port::dropped), machine);
}

std::string_view path_at_own_port(PublicAddress const& own, std::string_view machine) noexcept
{
    constexpr std::uint16_t https = 443;
    constexpr std::uint16_t http = 80;
    bool const is_usual_port = own.port == (own.ssl ? https : http);
    if (own.port_rewrite || is_usual_port || own.host.empty() || !machine.starts_with(own.host))
        return {};
    machine.remove_prefix(own.host.size());
    return machine.starts_with('/') ? machine : std::string_view();
}

std::string own_authority(PublicAddress const& address, std::vector<std::string> const& names,
                          std::string_view host)
{
    auto const asked = host_of(host, Port::dropped);
    auto const is_asked = [&asked](std::string_view name) { return equal_ignoring_case(asked, name); };
    if (address.host == asked_name || address.host == "localhost" || is_asked(address.host) ||
        std::any_of(names.begin(), names.end(), is_asked))
        return host_of(host, Port::kept);
    return concat(address.host, address.port_rewrite ? "/" : ":", std::to_string(address.port));
}

} // namespace webots_cloud::core
