// Loads the library of NVIDIA's driver if there is one, and asks it once a second on a thread of its own,
// because a driver may take long to answer. Everybody else reads the last sample.
#include "nvml.hpp"

#include "core/text.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {
namespace {

constexpr auto look_interval = std::chrono::seconds(1);
constexpr auto first_look = std::chrono::seconds(3); // that a start waits for
constexpr auto last_look = std::chrono::seconds(2);  // that an end waits for
constexpr auto remembered = std::chrono::minutes(1); // of a process that does nothing
constexpr unsigned max_devices = 64;
constexpr unsigned max_samples = 1024; // of the processes of one device
constexpr std::size_t max_processes = 4096;
constexpr int success = 0; // NVML_SUCCESS

// As nvml.h has had them since version 2 of its interface.
using Device = void*;
struct Utilization
{
    unsigned gpu = 0;    ///< Percent of the last moments in which something was computed.
    unsigned memory = 0; ///< Percent in which memory was read or written.
};
struct Memory
{
    unsigned long long total = 0;
    unsigned long long free = 0;
    unsigned long long used = 0;
};

/// Of one process, in percent.
struct ProcessUtilization
{
    unsigned process = 0;
    unsigned long long time = 0; ///< Microseconds.
    unsigned compute = 0;
    unsigned memory = 0;
    unsigned encoder = 0;
    unsigned decoder = 0;
};

/// The functions of the library that we need.
class Library
{
public:
    explicit Library(std::string const& name) : handle_(::dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL))
    {
        complete_ = handle_ && find(init_, "nvmlInit_v2") && find(count_, "nvmlDeviceGetCount_v2") &&
                    find(device_, "nvmlDeviceGetHandleByIndex_v2") && find(name_, "nvmlDeviceGetName") &&
                    find(utilization_, "nvmlDeviceGetUtilizationRates") &&
                    find(memory_, "nvmlDeviceGetMemoryInfo");
        if (handle_)
            (void)find(processes_, "nvmlDeviceGetProcessUtilization"); // not in old drivers
    }
    // Never closed: a driver's threads may still be inside.

    bool complete() const noexcept { return complete_; }

    std::vector<Device> devices() const
    {
        unsigned count = 0;
        if (init_() != success || count_(&count) != success)
            return {};
        std::vector<Device> found;
        for (unsigned i = 0; i < std::min(count, max_devices); ++i) {
            Device device = nullptr;
            if (device_(i, &device) == success)
                found.push_back(device);
        }
        return found;
    }

    /// Model and memory.
    std::string name(Device device) const
    {
        char text[96] = {};
        std::string name = name_(device, text, sizeof text - 1) == success ? text : "NVIDIA";
        Memory memory;
        if (memory_(device, &memory) == success && memory.total > 0)
            name += core::concat(" (", core::gigabytes(memory.total), ")");
        return name;
    }

    /// A figure that a processor does not tell counts as 0.
    GpuSample look(Device device) const
    {
        GpuSample sample;
        Utilization utilization;
        if (utilization_(device, &utilization) == success) {
            sample.compute = std::min(100U, utilization.gpu);
            sample.memory_controller = std::min(100U, utilization.memory);
        }
        Memory memory;
        if (memory_(device, &memory) == success && memory.total > 0)
            sample.memory_used =
                std::min(100.0, 100 * static_cast<double>(memory.used) / static_cast<double>(memory.total));
        return sample;
    }

    /// Percent of `device` that each process has used, on average, since the time that is remembered in
    /// `seen`. A driver that does not know or say so has none.
    std::map<int, double> look_at_processes(Device device, unsigned long long& seen) const
    {
        std::vector<ProcessUtilization> samples(max_samples);
        unsigned count = max_samples;
        if (!processes_ || processes_(device, samples.data(), &count, seen) != success)
            return {};
        samples.resize(std::min(count, max_samples));
        std::map<int, std::pair<double, int>> sums;
        for (auto const& sample : samples) {
            seen = std::max(seen, sample.time);
            auto& [sum, number] = sums[static_cast<int>(sample.process)];
            sum += std::min(100U, sample.compute);
            ++number;
        }
        std::map<int, double> means;
        for (auto const& [process, sum] : sums)
            means.emplace(process, sum.first / sum.second);
        return means;
    }

private:
    template<class Function>
    bool find(Function& function, char const* name)
    {
        function = reinterpret_cast<Function>(::dlsym(handle_, name));
        return function != nullptr;
    }

    void* handle_;
    bool complete_ = false;
    int (*init_)() = nullptr;
    int (*count_)(unsigned*) = nullptr;
    int (*device_)(unsigned, Device*) = nullptr;
    int (*name_)(Device, char*, unsigned) = nullptr;
    int (*utilization_)(Device, Utilization*) = nullptr;
    int (*memory_)(Device, Memory*) = nullptr;
    int (*processes_)(Device, ProcessUtilization*, unsigned*, unsigned long long) = nullptr;
};

std::string describe(Library const& library, std::vector<Device> const& devices)
{
    std::string text;
    for (std::size_t i = 0; i < devices.size();) {
        auto const name = library.name(devices[i]);
        std::size_t same = 1;
        while (i + same < devices.size() && library.name(devices[i + same]) == name)
            ++same;
        text += core::concat(text.empty() ? "" : ", ", same > 1 ? std::to_string(same) + "x " : "", name);
        i += same;
    }
    return text;
}

GpuSample highest(Library const& library, std::vector<Device> const& devices)
{
    GpuSample max;
    for (auto* const device : devices) {
        auto const one = library.look(device);
        max.compute = std::max(max.compute, one.compute);
        max.memory_controller = std::max(max.memory_controller, one.memory_controller);
        max.memory_used = std::max(max.memory_used, one.memory_used);
    }
    return max;
}

/// How long each process has kept the devices busy, added up from one look to the next.
class ProcessTimes
{
public:
    using Clock = std::chrono::steady_clock;

    void look(Library const& library, std::vector<Device> const& devices)
    {
        auto const now = Clock::now();
        auto const since = now - std::exchange(last_, now);
        seen_.resize(devices.size());
        for (std::size_t i = 0; i < devices.size(); ++i)
            for (auto const& [process, percent] : library.look_at_processes(devices[i], seen_[i])) {
                if (times_.size() >= max_processes && !times_.contains(process))
                    continue;
                auto& time = times_[process];
                time.busy += std::chrono::duration_cast<Duration>(since * (percent / 100));
                time.noted = now;
            }
        std::erase_if(times_, [now](auto const& entry) { return now - entry.second.noted > remembered; });
    }

    Duration busy(std::span<int const> processes) const
    {
        Duration sum{};
        for (int const process : processes)
            if (auto const found = times_.find(process); found != times_.end())
                sum += found->second.busy;
        return sum;
    }

private:
    struct Time
    {
        Duration busy{};
        Clock::time_point noted;
    };

    Clock::time_point last_ = Clock::now();
    std::vector<unsigned long long> seen_; ///< Of each device, the time of its last sample.
    std::map<int, Time> times_;
};

} // namespace

/// What the thread that asks the driver shares with those who read. A driver may hold that thread for ever,
/// so this may outlive them.
struct NvidiaGpus::Shared
{
    explicit Shared(Library found) : library(found) {}

    void watch()
    {
        auto const devices = library.devices();
        auto const name = describe(library, devices);
        ProcessTimes looked_at;
        for (bool going_on = !devices.empty(); going_on;) {
            auto const sample = highest(library, devices);
            looked_at.look(library, devices);
            std::unique_lock lock(mutex);
            latest = sample;
            times = looked_at;
            text = name;
            count = static_cast<int>(devices.size());
            looked = true;
            changed.notify_all();
            going_on = !changed.wait_for(lock, look_interval, [this] { return stopping; });
        }
        // Also without any device, or the start would wait for a sample.
        std::lock_guard const lock(mutex);
        looked = done = true;
        changed.notify_all();
    }

    Library const library;
    mutable std::mutex mutex;
    std::condition_variable changed;
    std::optional<GpuSample> latest;
    ProcessTimes times;
    std::string text;
    int count = 0;
    bool looked = false;
    bool stopping = false;
    bool done = false;
};

NvidiaGpus::NvidiaGpus(std::string const& name)
{
    Library const library(name);
    if (!library.complete())
        return;
    shared_ = std::make_shared<Shared>(library);
    std::thread([shared = shared_] { shared->watch(); }).detach();
    std::unique_lock lock(shared_->mutex);
    shared_->changed.wait_for(lock, first_look, [this] { return shared_->looked; });
}

NvidiaGpus::~NvidiaGpus()
{
    if (!shared_)
        return;
    std::unique_lock lock(shared_->mutex);
    shared_->stopping = true;
    shared_->changed.notify_all();
    shared_->changed.wait_for(lock, last_look, [this] { return shared_->done; });
}

std::optional<GpuSample> NvidiaGpus::sample() const
{
    if (!shared_)
        return std::nullopt;
    std::lock_guard const lock(shared_->mutex);
    return shared_->latest;
}

int NvidiaGpus::count() const
{
    if (!shared_)
        return 0;
    std::lock_guard const lock(shared_->mutex);
    return shared_->count;
}

Duration NvidiaGpus::busy(std::span<int const> processes) const
{
    if (!shared_)
        return {};
    std::lock_guard const lock(shared_->mutex);
    return shared_->times.busy(processes);
}

std::string NvidiaGpus::description() const
{
    if (!shared_)
        return {};
    std::lock_guard const lock(shared_->mutex);
    return shared_->text;
}

} // namespace webots_cloud::adapters
