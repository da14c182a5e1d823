// The paths of machines that browsers reach through the session server alone: `/machine/<id>/...`. Machines
// that were found by name, or have announced themselves, often have the same port, so that `/2000/...` would
// not tell them apart.
#pragma once

#include "core/text.hpp"
#include "forwarding.hpp"
#include "tickets.hpp"

#include <webots_cloud/fleet.hpp>

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace webots_cloud::core {

inline constexpr std::string_view machine_folder = "/machine/";

/// The id of a machine: 24 letters, which only its address and the secret decide. So it is the same after a
/// restart, at every session server with this secret, and for a machine that comes back at its address.
/// Letters only, as in the tokens of simulations: see `is_gateway_token`.
std::string machine_id(Mac const& mac, std::string_view address);

/// Below this path of ours browsers reach a machine: `/machine/<id>`. Empty: it has none.
std::string machine_path(Mac const& mac, ServerSpec const& server);

/// A path below `/machine/`.
struct MachinePath
{
    MachinePath() = default;

    std::string_view id;
    std::string_view rest; ///< What follows the id; starts with `/`.
};

/// `/machine/abc/client`: `abc` and `/client`; `/machine/abc`: `abc` and `/`. Views into the path.
std::optional<MachinePath> split_machine_path(std::string_view path) noexcept;

/// The machines of a fleet that have a path, and which of them are passed on to: those that have answered
/// their last poll as our simulation servers do. So names and announcements can't point the gateway at
/// other services of the network, and an address that a machine has left leads to nobody else.
///
/// No part of a request becomes a host or a port.
class MachinePaths final : public FleetObserver
{
public:
    /// That a machine has answered is kept as long as it is reached as before.
    void put(FleetMachine const& machine, FleetMachine const* was,
             std::optional<std::string_view> before) override;
    void remove(FleetMachine const& machine) override;

    /// Of a poll. Machines without a path are ignored.
    void answered(std::string_view address, bool as_ours);

    bool empty() const noexcept { return machines_.empty(); }

    /// As in FleetMachine.
    std::string_view path_of(std::string_view address) const noexcept;

    struct Found
    {
        Found() = default;

        std::string_view path;               ///< `/machine/<id>`.
        std::optional<ForwardTarget> target; ///< Nothing: it does not answer.
    };

    /// Nothing: no machine has this path, or it is the operator's.
    std::optional<Found> find(std::string_view path, std::string_view query) const;

private:
    struct Machine
    {
        Machine() = default;

        FleetMachine const* known = nullptr;
        InternalAddress internal;
        bool answers = false;
    };

    template<class Value>
    using ByText = std::unordered_map<std::string, Value, TextHash, std::equal_to<>>;

    ByText<Machine> machines_; ///< By address.
    ByText<Machine const*> by_id_;
};

} // namespace webots_cloud::core
