// Machines that get no new sessions since the operator has said so while the session server runs.
#pragma once

#include <webots_cloud/scheduler.hpp>

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

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

    /// The machines from now on, and what the configuration says of them.
    void list(std::vector<ServerSpec> servers);

    Outcome obey(DrainOrder const& order);

    /// The list, for the scheduler.
    std::vector<ServerSpec> servers() const;

    /// Who has drained a machine: `operator` or `configuration`; empty: neither.
    std::string_view drained_by(std::string_view address) const;

    /// How many the operator has drained.
    std::size_t count() const noexcept { return drained_.size(); }

private:
    ServerSpec const* find(std::string_view address) const;

    std::vector<ServerSpec> servers_;
    /// Their places by address; of equal ones the first. Pages ask for each of thousands of machines.
    std::map<std::string, std::size_t, std::less<>> places_;
    std::set<std::string, std::less<>> drained_; ///< By the operator.
};

} // namespace webots_cloud::placement
