// Reads and writes answers to /load (protocol section 4.2). A plain number comes from the Python servers,
// JSON from ours. A machine is not trusted: a report with one value that can't be true counts as no report.
#include <webots_cloud/load_report.hpp>

#include "core/machine_labels.hpp"
#include "core/text.hpp"
#include "project_digests.hpp"

#include <boost/json/array.hpp>
#include <boost/json/monotonic_resource.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <array>
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

constexpr std::size_t digest_length = 16;
constexpr double min_processors = 0.01;
constexpr double max_processors = 100'000;

/// A digest is 16 hexadecimal digits: numbers of 64 bits do not survive every JSON reader.
bool read_digest(json::object const& object, std::string_view key, std::uint64_t& digest)
{
    auto const* value = object.if_contains(key);
    auto const* text = value ? value->if_string() : nullptr;
    if (!text || text->size() != digest_length)
        return false;
    auto const [end, error] = std::from_chars(text->data(), text->data() + text->size(), digest, 16);
    return error == std::errc() && end == text->data() + text->size();
}

std::string digest_text(std::uint64_t digest)
{
    constexpr std::string_view digits = "0123456789abcdef";
    std::string text(digest_length, '0');
    for (auto digit = text.rbegin(); digest != 0; ++digit, digest /= 16)
        *digit = digits[digest % 16];
    return text;
}

/// Reads `key` if it is there; false when its value is no finite number from 0 up.
bool read_amount(json::object const& object, std::string_view key, double& amount)
{
    auto const* value = object.if_contains(key);
    if (!value)
        return true;
    boost::system::error_code ignored;
    if (!value->is_number() || !is_load(value->to_number<double>(ignored)))
        return false;
    amount = value->to_number<double>(ignored);
    return true;
}

std::optional<WorldUse> read_world(json::value const& entry)
{
    auto const* object = entry.if_object();
    WorldUse use;
    std::optional<int> running;
    std::optional<int> starting;
    if (!object || !read_digest(*object, "world", use.key.world) ||
        !read_digest(*object, "repository", use.key.repository) ||
        !read_digest(*object, "mode", use.key.mode) || !read_count(*object, "running", running) ||
        !read_count(*object, "starting", starting) || !read_amount(*object, "processors", use.processors) ||
        !read_amount(*object, "memory", use.memory) || !read_amount(*object, "graphics", use.graphics))
        return std::nullopt;
    use.running = running.value_or(0);
    use.starting = starting.value_or(0);
    return use;
}

/// `processors` and `worlds`: both or nothing.
bool read_worlds(json::object const& object, LoadReport& report)
{
    auto const* value = object.if_contains("worlds");
    if (!value)
        return true;
    auto const* list = value->if_array();
    double processors = 0;
    if (!list || list->size() > LoadReport::max_worlds || !read_amount(object, "processors", processors) ||
        processors < min_processors || processors > max_processors)
        return false;
    report.processors = processors;
    if (object.contains("memoryBytes")) {
        report.memory_bytes = 0;
        if (!read_amount(object, "memoryBytes", *report.memory_bytes) || *report.memory_bytes == 0)
            return false;
    }
    if (object.contains("graphicsProcessors")) {
        report.graphics_processors = 0;
        if (!read_amount(object, "graphicsProcessors", *report.graphics_processors) ||
            *report.graphics_processors < min_processors || *report.graphics_processors > max_processors)
            return false;
    }
    for (auto const& entry : *list) {
        auto const use = read_world(entry);
        if (!use)
            return false;
        report.worlds.push_back(*use);
    }
    return true;
}

bool read_projects(json::object const& object, std::vector<std::uint32_t>& projects)
{
    auto const* value = object.if_contains("projects");
    if (!value)
        return true;
    auto const* text = value->if_string();
    return text && core::read_digests(*text, LoadReport::max_projects, projects);
}

json::object world_json(WorldUse const& use)
{
    json::object object;
    object["world"] = digest_text(use.key.world);
    object["repository"] = digest_text(use.key.repository);
    object["mode"] = digest_text(use.key.mode);
    object["running"] = use.running;
    object["starting"] = use.starting;
    object["processors"] = use.processors;
    object["memory"] = use.memory;
    if (use.graphics > 0)
        object["graphics"] = use.graphics;
    return object;
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
        !read_count(object, "capacity", report.capacity) || !read_count(object, "staging", report.staging) ||
        !read_counters(object, report) || !read_labels(object, report.labels) ||
        !read_worlds(object, report) || !read_projects(object, report.projects))
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
    std::array<unsigned char, 4096> room; // those of small sites fit, and all of it is freed at once
    json::monotonic_resource memory(room.data(), room.size());
    boost::system::error_code error;
    auto const value = json::parse(text, error, &memory);
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
    if (report.processors) {
        object["processors"] = *report.processors;
        if (report.memory_bytes)
            object["memoryBytes"] = *report.memory_bytes;
        if (report.graphics_processors)
            object["graphicsProcessors"] = *report.graphics_processors;
        auto& worlds = object["worlds"].emplace_array();
        for (WorldUse const& use : report.worlds)
            worlds.push_back(world_json(use));
    }
    if (!report.projects.empty())
        object["projects"] = core::write_digests(report.projects);
    if (report.staging)
        object["staging"] = *report.staging;
    object["version"] = version;
    return json::serialize(object);
}

} // namespace webots_cloud
