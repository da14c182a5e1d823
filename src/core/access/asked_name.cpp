// Finds out of a request, and of what proxies have added to it, by which name, port, scheme and path its
// client reaches us.
#include "asked_name.hpp"

#include "core/public_place.hpp"
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

/// Completed by the port that a proxy names, and has left out of the Host header. Of the usual ports one is
/// that of another proxy in front: it is left out, as browsers do.
std::string with_port(std::string_view host, std::string_view port)
{
    constexpr std::uint16_t https = 443;
    constexpr std::uint16_t http = 80;
    auto const number = parse_port(port);
    auto const authority = boost::urls::parse_authority(host);
    bool const is_complete = number == 0 || number == https || number == http || !authority ||
                             authority->encoded_host().empty() || authority->has_port();
    return is_complete ? std::string(host) : concat(host, ":", std::to_string(number));
}

std::string_view scheme_of(bool tls) noexcept
{
    return tls ? "wss://" : "ws://";
}

} // namespace

AskedAddress asked_address(HeaderFields fields, bool is_from_proxy)
{
    AskedAddress asked;
    if (!is_from_proxy) { // most requests: nothing else is looked for
        auto const host = std::find_if(fields.begin(), fields.end(), [](auto const& field) {
            return equal_ignoring_case(field.first, "Host");
        });
        asked.host = host == fields.end() ? std::string_view() : host->second;
        return asked;
    }
    bool has_host = false;
    std::string_view port;
    for (auto const& [name, value] : fields) {
        if (!has_host && equal_ignoring_case(name, "Host")) {
            asked.host = value;
            has_host = true;
        } else if (equal_ignoring_case(name, "X-Forwarded-Prefix")) {
            auto const path = value.substr(0, value.size() - (value.ends_with('/') ? 1 : 0));
            asked.path = is_site_path(path) ? path : std::string_view();
        } else if (equal_ignoring_case(name, "X-Forwarded-Port")) {
            port = value;
        } else if (equal_ignoring_case(name, "X-Forwarded-Proto")) {
            // Traefik writes the scheme of a WebSocket.
            asked.tls = equal_ignoring_case(value, "https") || equal_ignoring_case(value, "wss");
        }
    }
    asked.host = with_port(asked.host, port);
    return asked;
}

std::string_view port_left_out(std::string_view origin, std::string_view host) noexcept
{
    constexpr std::string_view mark = "://";
    auto const scheme = origin.find(mark);
    if (scheme == std::string_view::npos || host.empty())
        return {};
    auto const place = origin.substr(scheme + mark.size());
    bool const has_more = place.size() > host.size() + 1 && place[host.size()] == ':';
    return has_more && equal_ignoring_case(place.substr(0, host.size()), host) ? place.substr(host.size() + 1)
                                                                               : std::string_view();
}

PublicAddress reached_at(PublicAddress address, AskedAddress const& asked)
{
    if (!asked.path.empty())
        address.path = asked.path;
    address.ssl = address.ssl || asked.tls;
    bool const is_in_path = address.port_rewrite || !address.path.empty();
    if (address.host == asked_name)
        address.host = host_of(asked.host, is_in_path ? Port::kept : Port::dropped);
    return address;
}

std::string machine_reached_at(std::string_view machine, PublicAddress const& own, AskedAddress const& asked)
{
    if (!machine.starts_with(asked_name))
        return concat(scheme_of(own.ssl), machine);
    machine.remove_prefix(asked_name.size());
    bool const is_in_path = machine.starts_with('/');
    return concat(scheme_of(own.ssl), host_of(asked.host, is_in_path ? Port::kept : Port::dropped), machine);
}

std::string_view path_at_own_port(PublicAddress const& own, std::string_view machine) noexcept
{
    constexpr std::uint16_t https = 443;
    constexpr std::uint16_t http = 80;
    bool const is_usual_port = own.port == (own.ssl ? https : http);
    if (own.port_rewrite || !own.path.empty() || is_usual_port || own.host.empty() ||
        !machine.starts_with(own.host))
        return {};
    machine.remove_prefix(own.host.size());
    return machine.starts_with('/') ? machine : std::string_view();
}

bool is_placed_by_proxy(PublicAddress const& own, AskedAddress const& asked) noexcept
{
    return !own.path.empty() || !asked.path.empty() || (asked.tls && !own.ssl);
}

std::string_view path_behind_proxy(PublicAddress const& own, std::vector<std::string> const& names,
                                   AskedAddress const& asked, std::string_view machine)
{
    auto const slash = machine.rfind('/');
    if (!is_placed_by_proxy(own, asked) || slash == std::string_view::npos ||
        parse_port(machine.substr(slash + 1)) == 0)
        return {};
    auto const place = machine.substr(0, slash);
    auto const path = path_in(place);
    auto const host = place.substr(0, place.size() - path.size());
    auto const is_host = [host](std::string_view name) { return equal_ignoring_case(host, name); };
    bool const is_ours = is_host(asked_name) || is_host(own.host) || is_host(asked.host) ||
                         is_host(host_of(asked.host, Port::dropped)) || std::ranges::any_of(names, is_host);
    // An entry that could name our path, and does not, is beside us.
    bool const is_below_us =
        path.empty() ? own.path.empty() || host == asked_name : path == own.path || path == asked.path;
    return is_ours && is_below_us ? machine.substr(slash) : std::string_view();
}

std::string own_base(PublicAddress const& address, std::vector<std::string> const& names,
                     AskedAddress const& asked)
{
    auto reached = reached_at(address, asked);
    auto const host = host_of(asked.host, Port::dropped);
    auto const is_asked = [&host](std::string_view name) { return equal_ignoring_case(host, name); };
    bool const is_name = address.host == asked_name || address.host == "localhost" ||
                         is_asked(address.host) || std::ranges::any_of(names, is_asked);
    return is_name ? concat(scheme_of(reached.ssl), host_of(asked.host, Port::kept), reached.path)
                   : concat(scheme_of(reached.ssl), public_place(reached));
}

} // namespace webots_cloud::core
