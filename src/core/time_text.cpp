#include "time_text.hpp"

#include "core/text.hpp"

#include <array>
#include <ctime>
#include <string_view>

namespace webots_cloud::core {
namespace {

using namespace std::chrono;

// In English, whatever the locale: RFC 5322 and RFC 9110 want them so.
constexpr std::array<std::string_view, 7> weekday_names = {"Sun", "Mon", "Tue", "Wed", "Thu", "Fri", "Sat"};
constexpr std::array<std::string_view, 12> month_names = {"Jan", "Feb", "Mar", "Apr", "May", "Jun",
                                                          "Jul", "Aug", "Sep", "Oct", "Nov", "Dec"};

/// With leading zeros.
std::string padded(long long value, std::size_t digits)
{
    auto text = std::to_string(value);
    if (text.size() < digits)
        text.insert(0, digits - text.size(), '0');
    return text;
}

/// A moment in UTC, in its parts.
class UtcTime
{
public:
    explicit UtcTime(WallTime when)
        : day_(floor<days>(when)), date_(day_), time_(floor<milliseconds>(when - day_))
    {}

    /// `2026-01-31`
    std::string date() const
    {
        return concat(year(), "-", padded(static_cast<unsigned>(date_.month()), 2), "-", day());
    }

    /// `Sat, 31 Jan 2026`
    std::string named_date() const
    {
        return concat(weekday_names[weekday(day_).c_encoding()], ", ", day(), " ",
                      month_names[static_cast<unsigned>(date_.month()) - 1], " ", year());
    }

    /// `23:59:58`
    std::string time() const
    {
        return concat(padded(time_.hours().count(), 2), ":", padded(time_.minutes().count(), 2), ":",
                      padded(time_.seconds().count(), 2));
    }

    /// `678`
    std::string fraction() const { return padded(time_.subseconds().count(), 3); }

private:
    std::string year() const { return padded(static_cast<int>(date_.year()), 4); }
    std::string day() const { return padded(static_cast<unsigned>(date_.day()), 2); }

    sys_days day_;
    year_month_day date_;
    hh_mm_ss<milliseconds> time_;
};

/// In the format of `strftime`.
std::string format_local(WallTime when, char const* format)
{
    std::time_t const seconds = system_clock::to_time_t(when);
    std::tm parts{};
    localtime_r(&seconds, &parts);
    char text[96];
    return {text, std::strftime(text, sizeof text, format, &parts)};
}

} // namespace

std::string iso_time(WallTime when)
{
    UtcTime const utc(when);
    return concat(utc.date(), "T", utc.time(), ".", utc.fraction(), "Z");
}

std::string utc_time(WallTime when)
{
    UtcTime const utc(when);
    return concat(utc.date(), " ", utc.time(), " UTC");
}

std::string mail_date(WallTime when)
{
    UtcTime const utc(when);
    return concat(utc.named_date(), " ", utc.time(), " +0000");
}

std::string http_date(WallTime when)
{
    UtcTime const utc(when);
    return concat(utc.named_date(), " ", utc.time(), " GMT");
}

std::string local_time(WallTime when)
{
    return format_local(when, "%Y-%m-%d %H:%M:%S");
}

std::string long_local_time(WallTime when)
{
    return format_local(when, "%A, %B %d, %Y at %H:%M:%S");
}

std::string unix_seconds(WallTime when)
{
    return std::to_string(floor<seconds>(when).time_since_epoch().count());
}

std::string age_text(Duration since)
{
    auto const whole = duration_cast<seconds>(since).count();
    if (whole < 120)
        return concat(std::to_string(whole), " s");
    return whole < 7200 ? concat(std::to_string(whole / 60), " min")
                        : concat(std::to_string(whole / 3600), " h");
}

std::string seconds_text(Duration duration)
{
    return std::to_string(duration_cast<seconds>(duration).count());
}

std::string seconds_rounded_up(Duration duration)
{
    return std::to_string(ceil<seconds>(duration).count());
}

} // namespace webots_cloud::core
