// Tells registries of simulation servers, such as webots.cloud, that this one exists (protocol section 11).
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>
#include <vector>

namespace webots_cloud {

struct RegistrationParams
{
    RegistrationParams() = default;

    std::vector<std::string> registries; ///< URLs that get the POST; none: nothing is done.
    std::string url;                     ///< Our own, as the world reaches it.
    double share_idle_time = 50;         ///< Percent.
    std::vector<std::string> allowed_repositories;
};

/// Posts to every registry once; a registry that can't be reached is tried again after 5, 10, 20 ... seconds, at most 10 minutes
/// apart. Never in the way of anything else: what fails costs a log line.
///
/// Lifetime: `http` and `clock` must outlive `run()`.   Thread-safety: one executor.
class Registration
{
public:
    Registration(RegistrationParams params, HttpClient& http, Clock& clock, Logger log) :
        params_(std::move(params)), http_(http), clock_(clock), log_(std::move(log))
    {}

    /// Ends only when cancelled.   Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

private:
    boost::asio::awaitable<void> register_at(std::string registry);

    RegistrationParams params_;
    HttpClient& http_;
    Clock& clock_;
    Logger log_;
};

} // namespace webots_cloud
