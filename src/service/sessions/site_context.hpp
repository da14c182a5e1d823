// What the parts of a session server share: what it was given, and where browsers reach its machines.
#pragma once

#include "core/access/machine_paths.hpp"
#include "core/access/site_addresses.hpp"
#include "core/discovery/machine_name.hpp"
#include "core/text.hpp"

#include <webots_cloud/fleet.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/session_service.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud {

struct SiteContext
{
    SiteContext(SessionConfig wanted, Fleet& machines, LoadMonitor& load_monitor, Scheduler& placing,
                Clock& time, Logger logger, SessionServiceHooks others)
        : config(std::move(wanted)), hooks(std::move(others)), fleet(machines), monitor(load_monitor),
          scheduler(placing), clock(time), log(std::move(logger))
    {}

    SessionConfig config; ///< Another one after SessionService::apply.
    SessionServiceHooks const hooks;
    Fleet& fleet;
    LoadMonitor& monitor;
    Scheduler& scheduler;
    Clock& clock;
    Logger log;
    core::MachinePaths paths;
    core::SiteAddresses addresses{config.address, config.access.host_names, config.service, fleet, paths};

    /// Not all machines are known at the start then.
    bool finds_machines() const
    {
        return config.announcements ||
               std::any_of(config.simulation_servers.begin(), config.simulation_servers.end(),
                           [](ServerSpec const& entry) { return core::stands_for_found(entry.address); });
    }

    /// `/ticket/<ticket>`, behind which a machine is asked for something where machines want tickets;
    /// otherwise empty.
    std::string ticket_path(std::string_view machine) const
    {
        return hooks.make_ticket ? core::concat("/ticket/", hooks.make_ticket(machine)) : std::string();
    }

    /// Where a browser that has asked us so is sent to a machine.
    std::string machine_address(std::string_view machine, AskedAddress const& by) const
    {
        auto address = addresses.address_of(machine, by);
        if (hooks.make_ticket)
            address += ticket_path(machine);
        return address;
    }
};

inline AskedAddress asked_by(IncomingRequest const& request)
{
    return core::asked_address(request.headers, request.is_from_proxy);
}

} // namespace webots_cloud
