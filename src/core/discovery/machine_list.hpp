// The list of machines, from all who name some; and how it changes, machine by machine.
#pragma once

#include "core/text.hpp"

#include <webots_cloud/fleet.hpp>

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// Machines stand in the order of their sources, and in that of their addresses within each. Of several
/// sources that name one machine the first counts.
///
/// A change costs what it changes, O(log n), and is taken over when somebody takes it. What was changed back
/// by then is no change.
class MachineList
{
public:
    /// A source names a machine, and how it is treated, from now on.
    void name(std::size_t source, ServerSpec const& machine);

    /// It does so no longer.
    void forget(std::size_t source, std::string_view address);

    /// Something has been named or forgotten since the last `take`.
    bool is_outdated() const noexcept { return !touched_.empty(); }

    /// What is different from what was taken before, one after the other, of at most this many machines.
    std::vector<ServerChange> take(std::size_t machines);

    /// As it was taken last.
    std::vector<ServerSpec> servers() const;

private:
    struct Machine
    {
        std::map<std::size_t, ServerSpec> named; ///< By source.
        std::optional<std::size_t> source;       ///< Nothing: it is not listed.
        ServerSpec listed;                       ///< How it is treated.
    };
    using Machines = std::unordered_map<std::string, Machine, TextHash, std::equal_to<>>;

    std::optional<ServerChange> update(Machines::iterator machine);

    Machines machines_; ///< By address.
    /// Those that are listed. Views into the keys of `machines_`.
    std::set<std::pair<std::size_t, std::string_view>> order_;
    std::set<std::string, std::less<>> touched_; ///< Addresses.
};

} // namespace webots_cloud::core
