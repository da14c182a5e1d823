// Asks a server of ours on this machine, for programs that have no event loop.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/http.hpp>

#include <cstdint>
#include <string>

namespace webots_cloud::adapters {

/// A server of ours on this machine.
struct OwnServer
{
    OwnServer() = default;

    std::string address = "127.0.0.1"; ///< Numeric.
    std::uint16_t port = 0;
    bool tls = false; ///< Its certificate does not count: nobody is between us and this machine.
};

/// Its answer to `GET target`, whatever its status, in JSON where the server has that; at most a megabyte. It
/// is asked as `localhost`. Blocks.
///
/// Errors: `unreachable`, `timed_out`, `protocol_error`; as of `find_watches`.
/// Thread-safety: any thread.
result<HttpResponse> ask_own_server(OwnServer const& server, std::string const& target, Duration limit);

} // namespace webots_cloud::adapters
