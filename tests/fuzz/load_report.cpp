// What machines say of their load: whatever they say, a report holds numbers that may be reckoned with, and
// says the same again.
#include "fuzz.hpp"

#include "core/text.hpp"

#include <webots_cloud/load_report.hpp>

#include <cmath>
#include <string>

using namespace webots_cloud;

namespace {

void check_count(std::optional<int> const& count)
{
    fuzz::require(!count || (*count >= 0 && *count <= 1'000'000));
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const report = parse_load_report(fuzz::text_of(data, size));
    if (!report) {
        auto const message = report.error().message();
        fuzz::require(report.error() == errc::protocol_error);
        fuzz::require(core::is_printable(message) && message.size() < 300);
        return 0;
    }
    fuzz::require(std::isfinite(report->load) && report->load >= 0);
    check_count(report->sessions);
    check_count(report->starting);
    check_count(report->capacity);
    fuzz::require(!report->memory || (std::isfinite(*report->memory) && *report->memory >= 0));
    auto again = parse_load_report(to_json(*report, "1"));
    fuzz::require(again.has_value());
    // Boost.JSON reads numbers of 17 digits to the last but one.
    fuzz::require(std::abs(again->load - report->load) <= report->load * 1e-14);
    fuzz::require(again->memory.has_value() == report->memory.has_value());
    again->load = report->load;
    again->memory = report->memory;
    fuzz::require(again->processors.has_value() == report->processors.has_value());
    again->processors = report->processors;
    fuzz::require(again->memory_bytes.has_value() == report->memory_bytes.has_value());
    again->memory_bytes = report->memory_bytes;
    fuzz::require(report->projects.size() <= LoadReport::max_projects);
    fuzz::require(again->worlds.size() == report->worlds.size() &&
                  report->worlds.size() <= LoadReport::max_worlds);
    for (std::size_t i = 0; i != report->worlds.size(); ++i) {
        fuzz::require(std::isfinite(report->worlds[i].processors) && report->worlds[i].processors >= 0);
        again->worlds[i].processors = report->worlds[i].processors;
        again->worlds[i].memory = report->worlds[i].memory;
    }
    fuzz::require(*again == *report);
    // As servers of the previous generation say it.
    auto const plain = parse_load_report(core::python_float(report->load));
    fuzz::require(plain && plain->load == report->load);
    return 0;
}
