// Names of hosts as people write them and as the network says them.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The name with each part that has letters beyond ASCII as browsers send it: `bücher.example` is
/// `xn--bcher-kva.example` (RFC 3492; of capitals only those of Latin-1 are made small before). What is no
/// UTF-8, or is too long for a name, is returned as it is, and a port stays.
std::string ascii_host_name(std::string_view name);

} // namespace webots_cloud::core
