// Tells registries of simulation servers, such as webots.cloud, that this one exists (protocol section 11).
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <memory>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Posts to every registry once; a registry that can't be reached is tried again after 5, 10, 20 ... seconds,
/// at most 10 minutes apart. All are told again when what they were told has changed. Never in the way of
/// anything else: what fails costs a log line.
///
/// Lifetime: `http` and `clock` must outlive it. It must outlive its operations: await their end before it is
/// destroyed.
/// Thread-safety: one executor.
class Registration
{
public:
    /// `config` says which registries get the POST (`notify`), and what these show: which repositories are
    /// allowed, and the share of idle time. `url`: our own, as the world reaches it.
    Registration(SimulationServiceConfig const& config, std::string url, HttpClient& http, Clock& clock,
                 Logger log);
    ~Registration();

    /// Ends only when cancelled.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

    /// Takes over its repositories; when they differ from what the registries know, those are told.
    void apply(SimulationServiceConfig const& config);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud
