// A simulation server in the list of a site: an entry of "simulationServers", or one that was found.
#pragma once

#include <webots_cloud/export.hpp>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// One simulation server as the operator describes it.
struct ServerSpec
{
    ServerSpec() = default;
    explicit ServerSpec(std::string entry) : address(std::move(entry)) {}

    /// Its entry of "simulationServers", verbatim: its unique name here, and an address for browsers.
    std::string address;
    /// How much it is loaded relative to others: a machine of weight 2 is filled to twice the percentage.
    /// Default 1, positive. Load is a percentage of the machine already, so a bigger machine needs no bigger
    /// weight; it is for preferences that the load does not show (a spare machine, or one with other tasks).
    double weight = 1;
    /// It gets no new sessions; those that it has stay.
    bool drain = false;
    /// What it can run, in words of the operator's, as in `gpu`, besides what it reports itself.
    std::vector<std::string> labels;
    /// Where the session server itself reaches it: `10.0.0.2:2000`, a numeric address, by plain HTTP; or
    /// `https://sim2.example.org:2000`, a name or an address, by TLS. Polls go there, and what the gateway
    /// passes on. Empty: it is polled at its address, and nothing is passed on.
    std::string internal_address;
    /// By TLS: its certificate is for this name. Empty: for the host of the internal address.
    std::string internal_name;
    /// Browsers reach it through the session server alone, below a path of its own there: as a machine that
    /// was found, of which several may have the same port. Only with `internal_address`.
    bool has_own_path = false;
    /// It was found, and is not on this machine: whatever a name server says, it is not reached at addresses
    /// of the loopback, and at no others that no machine can have.
    bool elsewhere = false;
    /// More ports of that machine that the gateway passes on, the first and the last. 0: none.
    std::uint16_t first_port = 0;
    std::uint16_t last_port = 0;
    /// Where it takes controllers from other machines: `10.0.0.2:2900`, by plain TCP. Those whose address has
    /// its port, as in `2000/<key>/<robot>`, are passed on there. Empty: none are.
    std::string controllers;
    /// Its operator is trusted like our own: the gateway passes on passwords for its monitor, and lets
    /// editors of its simulations have the origin of the site.
    bool trusted = false;
    /// How it was found: `dns:sim.example.org:2000`, as the entry that names it, or `announced`. Empty: it is
    /// an entry itself.
    std::string found_by;

    bool operator==(ServerSpec const&) const = default;
};

} // namespace webots_cloud
