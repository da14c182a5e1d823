// A line of the log as an object of JSON, for programs that collect logs.
#pragma once

#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// `{"time":"2026-01-02T03:04:05.678Z","level":"info","message":"..."}`, UTC, without a final newline.
///
/// Whatever `message` holds, the result is one line of well-formed JSON.
std::string json_log_line(WallTime when, LogLevel level, std::string_view message);

} // namespace webots_cloud::core
