#include "log_line.hpp"

#include "core/json_text.hpp"
#include "core/text.hpp"

#include <cstdio>

namespace webots_cloud::core {
namespace {

std::string iso_time(WallTime when)
{
    using namespace std::chrono;
    auto const day = floor<days>(when);
    year_month_day const date(day);
    hh_mm_ss const time(floor<milliseconds>(when - day));
    char text[64];
    std::snprintf(text, sizeof text, "%04d-%02u-%02uT%02d:%02d:%02d.%03dZ", static_cast<int>(date.year()),
                  static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                  static_cast<int>(time.hours().count()), static_cast<int>(time.minutes().count()),
                  static_cast<int>(time.seconds().count()), static_cast<int>(time.subseconds().count()));
    return text;
}

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
    std::string line = "{";
    append_key(line, "time");
    append_quoted(line, iso_time(when));
    append_key(line, "level");
    append_quoted(line, name(level));
    append_key(line, "message");
    if (is_utf8(message))
        append_quoted(line, message);
    else
        append_quoted(line, printable(message, message.size()));
    return line += '}';
}

} // namespace webots_cloud::core
