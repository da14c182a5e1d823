// The log: spdlog writes on a thread of its own, and drops the oldest lines rather than let the event loop
// wait for a disk. Lines are escaped and counted before (core/logs/log_budget), because clients cause many of
// them.
#include "core/logs/log_budget.hpp"
#include "core/logs/log_line.hpp"
#include "core/text.hpp"
#include "rotating_file.hpp"

#include <webots_cloud/adapters/logs.hpp>

#include <spdlog/async.h>
#include <spdlog/async_logger.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>

namespace webots_cloud {
namespace {

// As operators know it: 2026-01-02 03:04:05,678 [INFO   ]  message
constexpr auto pattern = "%Y-%m-%d %H:%M:%S,%e [%*]  %v";
constexpr std::size_t file_size = 500'000; // bytes
constexpr int old_files = 10;              // besides the one that is written
constexpr std::size_t queue_lines = 2048;  // a disk that stalls costs old lines, never the event loop

/// The level as Python prints it, seven wide.
class PythonLevel final : public spdlog::custom_flag_formatter
{
public:
    void format(spdlog::details::log_msg const& message, std::tm const&, spdlog::memory_buf_t& out) override
    {
        auto const name = [&]() -> std::string_view {
            switch (message.level) {
            case spdlog::level::debug:
                return "DEBUG  ";
            case spdlog::level::warn:
                return "WARNING";
            case spdlog::level::err:
                return "ERROR  ";
            default:
                return "INFO   ";
            }
        }();
        out.append(name.data(), name.data() + name.size());
    }

    std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<PythonLevel>(); }
};

spdlog::level::level_enum to_spdlog(LogLevel level)
{
    switch (level) {
    case LogLevel::debug:
        return spdlog::level::debug;
    case LogLevel::warning:
        return spdlog::level::warn;
    case LogLevel::error:
        return spdlog::level::err;
    case LogLevel::info:
        break;
    }
    return spdlog::level::info;
}

LogLevel from_spdlog(spdlog::level::level_enum level)
{
    switch (level) {
    case spdlog::level::debug:
        return LogLevel::debug;
    case spdlog::level::warn:
        return LogLevel::warning;
    case spdlog::level::err:
        return LogLevel::error;
    default:
        return LogLevel::info;
    }
}

/// An object of JSON a line.
class JsonFormatter final : public spdlog::formatter
{
public:
    void format(spdlog::details::log_msg const& message, spdlog::memory_buf_t& out) override
    {
        auto const when = std::chrono::time_point_cast<WallTime::duration>(message.time);
        auto line = core::json_log_line(when, from_spdlog(message.level),
                                        {message.payload.data(), message.payload.size()});
        line += '\n';
        out.append(line.data(), line.data() + line.size());
    }

    std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<JsonFormatter>(); }
};

std::unique_ptr<spdlog::formatter> make_formatter(bool json)
{
    if (json)
        return std::make_unique<JsonFormatter>();
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<PythonLevel>('*').set_pattern(pattern);
    return formatter;
}

/// The thread that writes and the logger that feeds it; the last copy of the Logger ends both, after the last
/// line.
struct Backend
{
    void write(LogLevel level, std::string_view line) const
    {
        logger->log(to_spdlog(level), spdlog::string_view_t(line.data(), line.size()));
    }

    std::shared_ptr<spdlog::details::thread_pool> thread;
    std::shared_ptr<spdlog::async_logger> logger;
};

/// Writes lines that clients cause as far as the budget allows, and at the end the counts not yet written.
class BudgetLimit final : public LogLimit
{
public:
    explicit BudgetLimit(std::shared_ptr<Backend const> backend) : backend_(std::move(backend)) {}

    ~BudgetLimit() override
    {
        for (auto const& [level, line] : budget_.sum_up_everything(std::chrono::steady_clock::now()))
            backend_->write(level, line);
    }

    void write(LogLevel level, LogCause const& cause, std::string_view line, Sink const& sink) override
    {
        if (budget_.take(std::chrono::steady_clock::now(), level, cause, line))
            sink(level, line);
    }

    void sum_up(Sink const& sink) override
    {
        for (auto const& [level, line] : budget_.sum_up(std::chrono::steady_clock::now()))
            sink(level, line);
    }

private:
    std::shared_ptr<Backend const> backend_;
    core::LogBudget budget_;
};

} // namespace

result<Logger> make_logger(LogParams params)
{
    auto const backend = std::make_shared<Backend>();
    try {
        spdlog::sink_ptr sink;
        if (params.file.empty())
            sink = std::make_shared<spdlog::sinks::stdout_sink_mt>();
        else
            sink = std::make_shared<adapters::RotatingFile>(params.file, file_size, old_files);
        backend->thread = std::make_shared<spdlog::details::thread_pool>(queue_lines, 1);
        backend->logger = std::make_shared<spdlog::async_logger>(
            "webots_cloud", std::move(sink), backend->thread, spdlog::async_overflow_policy::overrun_oldest);
    } catch (spdlog::spdlog_ex const& failure) {
        return Failure(errc::invalid_argument, core::concat("Log file ", params.file.string(),
                                                            " cannot be created: ", failure.what()));
    }
    backend->logger->set_formatter(make_formatter(params.json));
    backend->logger->set_level(spdlog::level::debug);
    backend->logger->flush_on(spdlog::level::debug);
    // Whatever a line quotes, it stays one, and steers no terminal; JSON has escapes of its own.
    bool const plain = !params.json;
    auto const sink = [backend, plain](LogLevel level, std::string_view line) {
        if (plain && !core::is_printable(line))
            backend->write(level, core::printable(line, 4 * line.size()));
        else
            backend->write(level, line);
    };
    return Logger(sink, params.debug ? LogLevel::debug : LogLevel::info,
                  std::make_shared<BudgetLimit>(backend));
}

} // namespace webots_cloud
