// The log, and what simulators print.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/simulation_logs.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <filesystem>
#include <memory>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Where a log is written, and how.
struct LogParams
{
    LogParams() = default;

    std::filesystem::path file; ///< Rotated at 500 000 bytes with 10 old files; empty: standard output.
    bool debug = false;         ///< Debug lines too.
    bool json = false;          ///< An object a line, with `time` (ISO 8601, UTC), `level` and `message`.
};

/// A log in the format that operators know, `YYYY-MM-DD HH:MM:SS,mmm [LEVEL  ]  message`, or in JSON.
/// Errors: `invalid_argument`.
result<Logger> make_logger(LogParams params);

/// The output of simulators: files `<date>_<time>_<simulation>.log` of at most 576 KiB, the first 512 KiB of
/// an output and the last 64 KiB. Written by a thread of its own; a file that can't be written costs one line
/// of `log`.
///
/// `folder` is made when the first one is opened. They are kept for `keep` since the last line, but no more
/// than 1000: the oldest go first.
///
/// Lifetime: `clock` must outlive it.
std::unique_ptr<SimulationLogs> make_simulation_logs(boost::asio::any_io_executor executor,
                                                     std::filesystem::path folder, Duration keep,
                                                     Clock& clock, Logger log);

} // namespace webots_cloud
