// Which addresses a student's page may name as its simulator: the teacher's page opens them.
#pragma once

#include "core/access/site_addresses.hpp"

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Where a student's simulation was started.
struct StudentMachine
{
    std::string entry;      ///< Of `simulationServers`: `host:2000`, `*:2000`, `host/2000`.
    std::string reached_at; ///< By that student: `ws://host:2000`.
    /// Its simulators are reached below its own address alone, so that none is beside it, at another port.
    bool is_closed = false;
};

/// Of a student whose browser has asked us so, and was sent to this entry.
StudentMachine student_machine(std::string_view entry, SiteAddresses const& addresses,
                               AskedAddress const& asked);

/// A simulator of this machine, as an entry of it would be: `*:2001`, `host/2000/simulation/abc/2001`. The
/// host is the machine's, not what the student's browser called it. Empty: what was reported is no simulator,
/// but a page's request to start something, or is none of this machine.
std::string simulator_entry(std::string_view reported, StudentMachine const& machine);

} // namespace webots_cloud::core
