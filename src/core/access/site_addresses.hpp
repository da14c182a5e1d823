// Where browsers reach the machines of a site, and its session server: at addresses of their own, below the
// server's (with the gateway), or below the path of a proxy in front.
#pragma once

#include "asked_name.hpp"
#include "machine_paths.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/public_address.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Answers for a browser that has asked us so (`by`). Machines are named by their entries in
/// `simulationServers`.
///
/// Lifetime: everything that it is made with must outlive it; it follows what changes there.
class SiteAddresses
{
public:
    /// `own`, `other_names`: of the session server.
    SiteAddresses(PublicAddress const& own, std::vector<std::string> const& other_names,
                  SessionServiceConfig const& config, Fleet const& fleet, MachinePaths const& paths)
        : own_(own), other_names_(other_names), config_(config), fleet_(fleet), paths_(paths)
    {}

    /// Where it reaches the session server.
    std::string own_base(AskedAddress const& by) const { return core::own_base(own_, other_names_, by); }

    /// Where it reaches a machine, or what is below one.
    std::string address_of(std::string_view machine, AskedAddress const& by) const;

    /// The same if that is below the session server; empty: it reaches the machine without us.
    std::string address_below_us(std::string_view machine, AskedAddress const& by) const;

    /// The path there: `/2000`, `/machine/<id>`. Empty likewise.
    std::string_view path_below_us(std::string_view machine, AskedAddress const& by) const;

    /// Whether `address_of` depends on `by`.
    bool depends_on_asked(std::string_view machine) const
    {
        return config_.gateway || !paths_.empty() || machine.starts_with(asked_name);
    }

    /// Whether a machine has its simulators below its own address alone: of the machines below us, which
    /// have this `path_below_us`, and behind the gateway no other ports are passed on.
    bool is_closed(std::string_view machine, std::string_view path) const noexcept
    {
        return config_.gateway && (public_port(machine) != 0 || !path.empty());
    }

    /// `/2000` of the path of a request, `/2000/client`, where the machine can't know by itself that browsers
    /// reach it there; empty otherwise.
    std::string path_unknown_to_machine(std::string_view path, AskedAddress const& by) const;

private:
    PublicAddress const& own_;
    std::vector<std::string> const& other_names_;
    SessionServiceConfig const& config_;
    Fleet const& fleet_;
    MachinePaths const& paths_;
};

} // namespace webots_cloud::core
