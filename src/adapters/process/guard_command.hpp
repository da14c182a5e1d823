// The command line of the guard (src/guard/main.cpp).
#pragma once

#include "control_groups.hpp"

#include <webots_cloud/transport/process_host.hpp>

#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// Without its name, and with the command line of the program at its end. `guard`: where it is, for one that
/// starts another elsewhere; `read_only`: folders that the program must not change; both absolute. `group`:
/// those of the program, null where it has none: what they limit needs no other limit.
std::vector<std::string> guard_arguments(ProcessSpec const& spec, std::string const& guard,
                                         std::vector<std::string> const& read_only,
                                         ControlGroups::Group const* group);

} // namespace webots_cloud::adapters
