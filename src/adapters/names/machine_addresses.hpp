// Which addresses of a machine that was found, and is known to be elsewhere, are connected to.
#pragma once

#include "name_channel.hpp"

#include <webots_cloud/error.hpp>

#include <string_view>

namespace webots_cloud::adapters {

/// Leaves out those of this machine's loopback, and those that no machine can have: a name server, or whoever
/// announces a machine, leads us to no service of our own machine. What leads to IPv4 is judged as that.
/// `name`: what was looked up.
///
/// Errors: `unreachable`: none is left.
result<> keep_those_elsewhere(Addresses& addresses, std::string_view name);

} // namespace webots_cloud::adapters
