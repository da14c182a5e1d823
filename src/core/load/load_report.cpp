#include <webots_cloud/load_report.hpp>

#include "core/machine_labels.hpp"
#include "core/text.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <charconv>
#include <cmath>

namespace webots_cloud {
namespace {

namespace json = boost::json;

// A float of Python has at most some 25 characters; what is longer is no load.
constexpr std::size_t max_number_length = 64;

Failure nonsense(std::string_view body)
{
    return {errc::protocol_error,
            core::concat("the load must be a number from 0 up, found \"", core::printable(body, 40), "\"")};
}

std::optional<double> plain_number(std::string_view text)
{
    double value = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (text.size() > max_number_length || error != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return value;
}

bool is_load(double value)
{
    return std::isfinite(value) && value >= 0;
}

/// Reads `key` if it is there; false when its value is not a count.
bool read_count(json::object const& object, std::string_view key, std::optional<int>& count)
{
    auto const* value = object.if_contains(key);
    if (!value)
        return true;
    auto const* number = value->if_int64();
    if (!number || *number < 0 || *number > 1'000'000)
        return false;
    count = static_cast<int>(*number);
    return true;
}

/// The same for a counter, which has no upper bound.
bool read_counter(json::object const& object, std::string_view key, std::optional<std::int64_t>& counter)
{
    auto const* value = object.if_contains(key);
    if (!value)
        return true;
    auto const* number = value->if_int64();
    if (!number || *number < 0)
        return false;
    counter = *number;
    return true;
}

/// The counters of arrivals and of what became of them: `failed` and `departures` are read only beside
/// `arrivals`.
bool read_counters(json::object const& object, LoadReport& report)
{
    if (!read_counter(object, "arrivals", report.arrivals))
        return false;
    return !report.arrivals || (read_counter(object, "failed", report.failed) &&
                                read_counter(object, "departures", report.departures));
}

bool read_labels(json::object const& object, std::vector<std::string>& labels)
{
    auto const* value = object.if_contains("labels");
    if (!value)
        return true;
    auto const* list = value->if_array();
    if (!list || list->size() > core::max_labels)
        return false;
    for (auto const& entry : *list) {
        auto const* label = entry.if_string();
        if (!label || !core::is_label(*label))
            return false;
        labels.emplace_back(*label);
    }
    return true;
}

std::optional<LoadReport> read_object(json::object const& object)
{
    LoadReport report;
    boost::system::error_code ignored;
    auto const* load = object.if_contains("load");
    if (!load || !load->is_number())
        return std::nullopt;
    report.load = load->to_number<double>(ignored);
    if (!is_load(report.load) || !read_count(object, "sessions", report.sessions) ||
        !read_count(object, "starting", report.starting) ||
        !read_count(object, "capacity", report.capacity) || !read_counters(object, report) ||
        !read_labels(object, report.labels))
        return std::nullopt;
    if (auto const* memory = object.if_contains("memory")) {
        if (!memory->is_number() || !is_load(memory->to_number<double>(ignored)))
            return std::nullopt;
        report.memory = memory->to_number<double>(ignored);
    }
    if (auto const* draining = object.if_contains("draining")) {
        if (!draining->is_bool())
            return std::nullopt;
        report.draining = draining->get_bool();
    }
    return report;
}

} // namespace

result<LoadReport> parse_load_report(std::string_view body)
{
    auto const text = core::trim(body);
    if (!text.starts_with('{')) {
        auto const load = plain_number(text);
        if (!load || !is_load(*load))
            return nonsense(body);
        return LoadReport(*load);
    }
    boost::system::error_code error;
    auto const value = json::parse(text, error);
    if (error || !value.is_object())
        return nonsense(body);
    auto report = read_object(value.get_object());
    if (!report)
        return nonsense(body);
    return *report;
}

std::string to_json(LoadReport const& report, std::string_view version)
{
    json::object object;
    object["load"] = report.load;
    if (report.sessions)
        object["sessions"] = *report.sessions;
    if (report.starting)
        object["starting"] = *report.starting;
    if (report.capacity)
        object["capacity"] = *report.capacity;
    if (report.memory)
        object["memory"] = *report.memory;
    object["draining"] = report.draining;
    if (report.arrivals)
        object["arrivals"] = *report.arrivals;
    if (report.failed)
        object["failed"] = *report.failed;
    if (report.departures)
        object["departures"] = *report.departures;
    if (!report.labels.empty())
        object["labels"] = json::array(report.labels.begin(), report.labels.end());
    object["version"] = version;
    return json::serialize(object);
}

} // namespace webots_cloud
