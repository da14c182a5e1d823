// What a name server says of a name.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Where a service runs, by a record SRV (RFC 2782).
struct NamedService
{
    NamedService() = default;

    std::string target; ///< A name, without a dot at the end.
    std::uint16_t port = 0;
    std::uint16_t priority = 0; ///< The smallest is asked first.
    std::uint16_t weight = 0;   ///< Relative to others of the same priority.
};

/// The addresses of a name, or its services.
struct NameAnswer
{
    NameAnswer() = default;

    std::vector<std::string> addresses; ///< Numeric, of IPv4 and IPv6.
    std::vector<NamedService> services;
    Duration ttl{}; ///< How long they are good for, by the name server's word.
};

} // namespace webots_cloud
