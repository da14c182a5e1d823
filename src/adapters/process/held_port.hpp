// Ports that are kept for programs that will listen on them.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <cstdint>
#include <memory>

namespace webots_cloud::adapters {

/// As ProcessHost::hold_port. Of IPv6 too: browsers that are told `localhost` ask `::1` first, where somebody
/// else may listen.
result<std::unique_ptr<PortHold>> hold_port(std::uint16_t port);

} // namespace webots_cloud::adapters
