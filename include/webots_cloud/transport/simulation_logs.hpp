// Where the output of simulators is kept for the operator, as a seam.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// The log of one simulation; complete when it has been destroyed.
/// Thread-safety: one executor.
class SimulationLog
{
public:
    virtual ~SimulationLog() = default;

    /// The name by which the operator finds it, for instance that of a file.
    virtual std::string const& name() const noexcept = 0;

    /// Adds a line; any bytes. Never blocks, never fails: what can't be kept is dropped.
    virtual void write(std::string_view line) = 0;
};

/// Makes the logs of simulations.
/// Lifetime: must outlive its logs.
/// Thread-safety: one executor.
class SimulationLogs
{
public:
    virtual ~SimulationLogs() = default;

    virtual std::unique_ptr<SimulationLog> open(std::uint64_t simulation) = 0;

    /// Removes outdated logs, now and from time to time.
    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    virtual boost::asio::awaitable<result<>> run() = 0;
};

} // namespace webots_cloud
