#include "monitor_sample.hpp"

#include "core/load/load_formula.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"

#include <cmath>

namespace webots_cloud::core {
namespace {

// The two clocks, ours and the calendar's, may drift apart by so much between two looks.
constexpr auto too_near = std::chrono::milliseconds(100);

double megabytes_per_second(std::uint64_t before, std::uint64_t after, Duration between)
{
    double const seconds = std::chrono::duration<double>(between).count();
    // An interface that went away takes its counters along.
    return after <= before || seconds <= 0 ? 0 : static_cast<double>(after - before) / 1e6 / seconds;
}

/// The value to the nearest 1/`scale`.
std::string rounded_to(double value, int scale)
{
    return python_float(std::round(value * scale) / scale);
}

} // namespace

std::array<std::string_view, MonitorSample::columns> const& MonitorSample::names() noexcept
{
    static constexpr std::array<std::string_view, columns> names = {
        "Webots running", "Webots idle", "CPU load", "CPU memory",   "GPU load compute", "GPU load memory",
        "GPU memory",     "Swap",        "Disk",     "Network sent", "Network received"};
    return names;
}

std::vector<float> MonitorSample::values() const
{
    std::vector<float> all;
    all.reserve(columns);
    for (double const value : {static_cast<double>(running), static_cast<double>(idle), cpu, memory,
                               gpu_compute, gpu_memory_controller, gpu_memory, swap, disk, sent, received})
        all.push_back(static_cast<float>(value));
    return all;
}

MonitorSample machine_figures(HostSample const& before, HostSample const& after, Duration between)
{
    MonitorSample sample;
    sample.cpu = cpu_percent(before, after);
    sample.memory = after.memory_used;
    if (after.gpu) {
        sample.gpu_compute = after.gpu->compute;
        sample.gpu_memory_controller = after.gpu->memory_controller;
        sample.gpu_memory = after.gpu->memory_used;
    }
    sample.swap = after.swap_used;
    sample.disk = after.disk_used;
    sample.sent = megabytes_per_second(before.bytes_sent, after.bytes_sent, between);
    sample.received = megabytes_per_second(before.bytes_received, after.bytes_received, between);
    return sample;
}

std::string monitor_csv_header()
{
    std::string line = "Timestamp";
    for (auto const name : MonitorSample::names())
        line.append(", ").append(name);
    return line + "\n";
}

std::string monitor_csv_line(WallTime time, MonitorSample const& sample)
{
    // A look that comes a moment too early belongs to the second that it was meant for.
    auto line = unix_seconds(time + too_near);
    for (int const count : {sample.running, sample.idle})
        line.append(", ").append(std::to_string(count));
    for (double const percent : {sample.cpu, sample.memory, sample.gpu_compute, sample.gpu_memory_controller,
                                 sample.gpu_memory, sample.swap, sample.disk})
        line.append(", ").append(rounded_to(percent, 10));
    for (double const rate : {sample.sent, sample.received})
        line.append(", ").append(rounded_to(rate, 1000));
    return line + "\n";
}

Duration until_next_second(WallTime now) noexcept
{
    constexpr auto second = std::chrono::seconds(1);
    auto const next = std::chrono::floor<std::chrono::seconds>(now) + second;
    auto const wait = std::chrono::duration_cast<Duration>(next - now);
    return wait < too_near ? wait + second : wait;
}

} // namespace webots_cloud::core
