#include "log_line.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <boost/json/object.hpp>
#include <boost/json/serialize.hpp>

namespace webots_cloud::core {
namespace {

std::string_view name(LogLevel level) noexcept
{
    switch (level) {
    case LogLevel::debug:
        return "debug";
    case LogLevel::warning:
        return "warning";
    case LogLevel::error:
        return "error";
    case LogLevel::info:
        break;
    }
    return "info";
}

} // namespace

std::string json_log_line(WallTime when, LogLevel level, std::string_view message)
{
    boost::json::object line;
    line["time"] = iso_time(when);
    line["level"] = name(level);
    line["message"] = is_utf8(message) ? std::string(message) : printable(message, message.size());
    return boost::json::serialize(line);
}

} // namespace webots_cloud::core
