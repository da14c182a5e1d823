// Tells session servers that this simulation server is there.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Announces a machine to every session server each ten seconds, and says goodbye when it ends. What fails
/// costs a log line, and is tried again ten seconds later.
///
/// Lifetime: `http` and `clock` must outlive it. It must outlive its operations: await their end before it is
/// destroyed.
/// Thread-safety: one executor.
class Announcing
{
public:
    /// `session_servers`: URLs, as in `https://session.example.org`; none: nobody is told. `address`: our
    /// own, as an entry of "simulationServers". `mac` signs (HMAC-SHA256, with a secret that the session
    /// servers know).
    Announcing(std::vector<std::string> session_servers, std::string address, HttpClient& http, Clock& clock,
               Logger log, std::function<std::string(std::string_view message)> mac);
    ~Announcing();

    /// Ends only when cancelled, after a goodbye of two seconds at most.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
