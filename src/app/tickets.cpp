#include "tickets.hpp"

#include "core/access/ip_address.hpp"
#include "core/access/tickets.hpp"
#include "core/discovery/machine_name.hpp"
#include "core/public_place.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/secrets.hpp>

#include <memory>

namespace webots_cloud::app {

using core::concat;

result<std::function<std::string(std::string_view)>> ticket_maker(SessionConfig const& config, Clock& clock)
{
    using Maker = std::function<std::string(std::string_view)>;
    if (config.access.session_secret.empty())
        return Maker();
    auto mac = make_ticket_mac(config.access.session_secret);
    if (!mac)
        return mac.error();
    return Maker([mac = std::move(*mac), &clock](std::string_view server) {
        return core::make_ticket(mac, server, random_bytes(core::ticket_nonce_size), clock.wall());
    });
}

result<std::function<std::optional<Failure>(std::string_view)>> ticket_check(SimulationConfig const& config,
                                                                             Clock& clock, Logger log)
{
    using Check = std::function<std::optional<Failure>(std::string_view)>;
    if (config.access.session_secret.empty())
        return Check();
    auto mac = make_ticket_mac(config.access.session_secret);
    if (!mac)
        return mac.error();
    auto const port = std::to_string(config.address.port);
    // A ticket names the machine as its session server does. That may be any of our names.
    std::vector<std::string> names;
    if (!config.address.path.empty())
        names.push_back(core::public_place(config.address));
    names.push_back(concat(config.address.host, ":", port));
    for (auto const& name : config.access.host_names)
        names.push_back(concat(name, ":", port));
    // Session servers that have found us by an address call us by that.
    for (auto const& addresses : {own_ipv4_addresses(), own_ipv6_addresses()})
        for (auto const& text : addresses)
            if (auto const address = core::IpAddress::parse(text))
                names.push_back(core::machine_at(*address, config.address.port));
    auto hint = concat(
        "A ticket was refused: it is not of a session server with our \"sessionSecret\", or not for ",
        names.front(), ". If its entry of \"simulationServers\" has another name, add that to \"hostNames\"");
    // Shared by all copies of the function: a ticket that one has taken is used up for all.
    auto const book = std::make_shared<core::TicketBook>(std::move(*mac), std::move(names));
    return Check([book, &clock, log = std::move(log), hint = std::move(hint)](std::string_view ticket) {
        auto const verdict = book->redeem(ticket, clock.wall());
        if (verdict == core::TicketVerdict::unknown)
            log.warning(LogCause("ticket"), hint);
        return core::refusal(verdict);
    });
}

} // namespace webots_cloud::app
