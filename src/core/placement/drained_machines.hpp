// Machines that get no new sessions since the operator has said so while the session server runs.
#pragma once

#include "core/text.hpp"

#include <webots_cloud/scheduler.hpp>

#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>

namespace webots_cloud::placement {

/// The query of `POST /api/drain`.
struct DrainOrder
{
    std::string machine; ///< Its address, as in its ServerSpec.
    bool off = false;    ///< It is to get sessions again.

    bool operator==(DrainOrder const&) const = default;
};

/// Reads `machine=sim1:2000`, with `off` before or behind it; the address may be percent-encoded.
std::optional<DrainOrder> parse_drain_order(std::string_view query);

/// Kept until it is taken back, the machine leaves the list, or the session server ends. Nothing is sent to
/// the machine, so this works with machines of every kind.
class DrainedMachines
{
public:
    enum class Outcome
    {
        done,
        unknown,   ///< No such machine is listed.
        configured ///< It gets no sessions since the configuration says so.
    };

    /// A machine, and what the configuration says of it from now on.
    void put(ServerSpec server);

    /// It has left the list.
    void remove(std::string_view address);

    /// It is listed, and the configuration says exactly this of it.
    bool lists(ServerSpec const& server) const;

    Outcome obey(DrainOrder const& order);

    /// How the scheduler is to treat a machine.
    /// Precondition: it is listed.
    ServerSpec treated(std::string_view address) const;

    /// Who has drained a machine: `operator` or `configuration`; empty: neither.
    std::string_view drained_by(std::string_view address) const;

    /// How many the operator has drained.
    std::size_t count() const noexcept { return drained_.size(); }

private:
    std::unordered_map<std::string, ServerSpec, core::TextHash, std::equal_to<>> servers_; ///< By address.
    std::set<std::string, std::less<>> drained_; ///< By the operator.
};

} // namespace webots_cloud::placement
