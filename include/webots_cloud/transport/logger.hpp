// The log as a seam: a level and a function. Whoever embeds the library decides where lines go.
#pragma once

#include <functional>
#include <string_view>
#include <utility>

namespace webots_cloud {

enum class LogLevel
{
    debug,
    info,
    warning,
    error
};

/// Passes lines of at least its level to a sink; copies share the sink. Without a sink it is silent.
///
/// The sink gets whole lines without a final newline and may be called from the executor's thread only.
class Logger
{
public:
    using Sink = std::function<void(LogLevel, std::string_view line)>;

    Logger() = default;
    explicit Logger(Sink sink, LogLevel least = LogLevel::info) : sink_(std::move(sink)), least_(least) {}

    void debug(std::string_view line) const { write(LogLevel::debug, line); }
    void info(std::string_view line) const { write(LogLevel::info, line); }
    void warning(std::string_view line) const { write(LogLevel::warning, line); }
    void error(std::string_view line) const { write(LogLevel::error, line); }

    void write(LogLevel level, std::string_view line) const
    {
        if (sink_ && level >= least_)
            sink_(level, line);
    }

private:
    Sink sink_;
    LogLevel least_ = LogLevel::info;
};

} // namespace webots_cloud
