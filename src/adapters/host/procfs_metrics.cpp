// Figures of the machine from proc(5), narrowed to the limits of a container or service where they are lower
// (cgroup_limits.hpp). What they mean as load is decided by core/load/load_formula.
#include "cgroup_limits.hpp"
#include "machine_graphics.hpp"
#include "nvml.hpp"

#include <webots_cloud/adapters/host.hpp>

#include <sys/statvfs.h>
#include <unistd.h>

#include <charconv>
#include <fstream>
#include <sstream>
#include <string_view>
#include <thread>

namespace webots_cloud {
namespace {

double percent(double part, double whole)
{
    return whole > 0 ? 100 * part / whole : 0;
}

/// The value behind `key` in a file of `key: value` lines, without the quotes of /etc/os-release.
std::string value_of(char const* file, std::string_view key, char separator)
{
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
        if (!line.starts_with(key))
            continue;
        auto const at = line.find(separator);
        auto const first = at == std::string::npos ? at : line.find_first_not_of(" \t\"", at + 1);
        if (first == std::string::npos)
            return {};
        return line.substr(first, line.find_last_not_of(" \t\"") - first + 1);
    }
    return {};
}

/// The machine that this process runs on, or its part of it.
class ProcfsMetrics final : public HostMetrics
{
public:
    explicit ProcfsMetrics(HostMetricsParams const& params)
        : limits_(params.control_groups, params.own_control_group),
          gpus_(std::make_shared<adapters::NvidiaGpus>(params.nvidia_library)),
          graphics_(std::make_shared<adapters::MachineGraphics>(gpus_))
    {}

    HostSample sample() override;
    HostDescription description() override;
    std::shared_ptr<GraphicsTimes const> graphics_times() override
    {
        return graphics_->count() > 0 ? graphics_ : nullptr;
    }

private:
    adapters::CgroupLimits limits_;
    std::shared_ptr<adapters::NvidiaGpus const> gpus_;
    std::shared_ptr<adapters::MachineGraphics const> graphics_;
};

std::uint64_t memory_bytes()
{
    return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
           static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void read_processors(HostSample& sample)
{
    // proc(5): user nice system idle iowait irq softirq steal; guest times are counted in user and nice
    // already.
    std::ifstream stat("/proc/stat");
    std::string name;
    std::uint64_t ticks = 0;
    stat >> name;
    for (int column = 0; column < 8 && stat >> ticks; ++column) {
        bool const idle = column == 3 || column == 4;
        sample.cpu_total += ticks;
        sample.cpu_busy += idle ? 0 : ticks;
    }
}

void read_memory(HostSample& sample)
{
    std::ifstream meminfo("/proc/meminfo");
    double total = 0;
    double available = 0;
    double swap_total = 0;
    double swap_free = 0;
    for (std::string line; std::getline(meminfo, line);) {
        std::istringstream fields(line);
        std::string key;
        double value = 0;
        fields >> key >> value;
        if (key == "MemTotal:")
            total = value;
        else if (key == "MemAvailable:")
            available = value;
        else if (key == "SwapTotal:")
            swap_total = value;
        else if (key == "SwapFree:")
            swap_free = value;
    }
    sample.memory_used = percent(total - available, total);
    sample.swap_used = percent(swap_total - swap_free, swap_total);
}

void read_network(HostSample& sample)
{
    std::ifstream devices("/proc/net/dev");
    std::string line;
    std::getline(devices, line); // two lines of headings
    std::getline(devices, line);
    while (std::getline(devices, line)) {
        auto const colon = line.find(':');
        if (colon == std::string::npos || line.substr(0, colon).find_first_not_of(" lo") == std::string::npos)
            continue;
        std::istringstream fields(line.substr(colon + 1));
        std::uint64_t received = 0;
        std::uint64_t other = 0;
        std::uint64_t sent = 0;
        fields >> received;
        for (int column = 1; column < 8; ++column)
            fields >> other;
        fields >> sent;
        sample.bytes_received += received;
        sample.bytes_sent += sent;
    }
}

HostSample ProcfsMetrics::sample()
{
    HostSample sample;
    read_processors(sample);
    read_memory(sample);
    read_network(sample);
    struct statvfs disk;
    if (::statvfs("/", &disk) == 0) {
        auto const used = static_cast<double>(disk.f_blocks - disk.f_bfree);
        sample.disk_used = percent(
            used,
            used + static_cast<double>(disk.f_bavail)); // as df has it: what root alone may use is neither
    }
    limits_.apply(sample, static_cast<int>(std::thread::hardware_concurrency()), memory_bytes());
    sample.gpu = gpus_->sample();
    return sample;
}

int threads_per_core()
{
    auto const threads = value_of("/proc/cpuinfo", "siblings", ':'); // of one processor
    auto const cores = value_of("/proc/cpuinfo", "cpu cores", ':');
    int thread_count = 0;
    int core_count = 0;
    std::from_chars(threads.data(), threads.data() + threads.size(), thread_count);
    std::from_chars(cores.data(), cores.data() + cores.size(), core_count);
    return core_count > 0 && thread_count > core_count ? thread_count / core_count : 1;
}

HostDescription ProcfsMetrics::description()
{
    HostDescription host;
    host.system = value_of("/etc/os-release", "PRETTY_NAME", '=');
    host.processor = value_of("/proc/cpuinfo", "model name", ':');
    host.cores = static_cast<int>(std::thread::hardware_concurrency());
    host.threads_per_core = threads_per_core();
    host.memory_bytes = memory_bytes();
    host.gpu = gpus_->description();
    host.graphics_processors = graphics_->count();
    char name[256] = {};
    if (::gethostname(name, sizeof name - 1) == 0)
        host.name = name;
    return host;
}

} // namespace

std::unique_ptr<HostMetrics> make_host_metrics(HostMetricsParams params)
{
    return std::make_unique<ProcfsMetrics>(params);
}

} // namespace webots_cloud
