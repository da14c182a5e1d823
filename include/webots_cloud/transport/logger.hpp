// The log as a seam: a level and a function. Whoever embeds the library decides where lines go.
#pragma once

#include <webots_cloud/export.hpp>

#include <functional>
#include <memory>
#include <string_view>
#include <utility>

namespace WEBOTS_CLOUD_API webots_cloud {

enum class LogLevel
{
    debug,
    info,
    warning,
    error
};

/// The cause of a line that clients can trigger: its topic, and the client.
struct LogCause
{
    LogCause() = default;
    LogCause(std::string_view topic, std::string_view client = {}) : topic(topic), client(client) {}

    std::string_view topic; ///< A constant in our code: lines of a topic count together, whatever they quote.
    /// An address, or the number of a conversation. Empty: each line is about another client.
    std::string_view client;
};

/// Limits the lines that clients cause.
class LogLimit
{
public:
    virtual ~LogLimit() = default;

    using Sink = std::function<void(LogLevel, std::string_view line)>;

    /// Passes the line to `sink`, or counts it.
    virtual void write(LogLevel level, LogCause const& cause, std::string_view line, Sink const& sink) = 0;

    /// Writes the counts that are due: to be called every few seconds.
    virtual void sum_up(Sink const& sink) = 0;
};

/// Passes lines of at least its level to a sink; copies share the sink. Without a sink it is silent.
///
/// Lines with a cause are those that any client could make us write again and again; a limit, if there is
/// one, keeps them from filling the log. Lines without a cause are never left out.
///
/// The sink gets whole lines without a final newline and may be called from the executor's thread only.
class Logger
{
public:
    using Sink = LogLimit::Sink;

    Logger() = default;
    explicit Logger(Sink sink, LogLevel min_level = LogLevel::info, std::shared_ptr<LogLimit> limit = nullptr)
        : sink_(std::move(sink)), min_level_(min_level), limit_(std::move(limit))
    {}

    void debug(std::string_view line) const { write(LogLevel::debug, line); }
    void info(std::string_view line) const { write(LogLevel::info, line); }
    void warning(std::string_view line) const { write(LogLevel::warning, line); }
    void error(std::string_view line) const { write(LogLevel::error, line); }

    void info(LogCause const& cause, std::string_view line) const { write(LogLevel::info, cause, line); }
    void warning(LogCause const& cause, std::string_view line) const
    {
        write(LogLevel::warning, cause, line);
    }
    void error(LogCause const& cause, std::string_view line) const { write(LogLevel::error, cause, line); }

    void write(LogLevel level, std::string_view line) const
    {
        if (sink_ && level >= min_level_)
            sink_(level, line);
    }

    void write(LogLevel level, LogCause const& cause, std::string_view line) const
    {
        if (!limit_)
            write(level, line);
        else if (sink_ && level >= min_level_)
            limit_->write(level, cause, line, sink_);
    }

    /// Has the limit write its counts.
    void sum_up() const
    {
        if (sink_ && limit_)
            limit_->sum_up(sink_);
    }

private:
    Sink sink_;
    LogLevel min_level_ = LogLevel::info;
    std::shared_ptr<LogLimit> limit_;
};

} // namespace webots_cloud
