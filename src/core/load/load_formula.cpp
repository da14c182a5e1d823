#include "load_formula.hpp"

#include <algorithm>
#include <numeric>

namespace webots_cloud::core {

namespace {

double growth_percent(std::uint64_t busy_before, std::uint64_t busy_after, std::uint64_t total_before,
                      std::uint64_t total_after) noexcept
{
    // The counters of a virtual machine may decrease when it is migrated: then the load is unknown.
    if (total_after <= total_before || busy_after < busy_before)
        return 0;
    auto const busy = static_cast<double>(busy_after - busy_before);
    return std::min(100.0, 100 * busy / static_cast<double>(total_after - total_before));
}

} // namespace

double cpu_percent(HostSample const& before, HostSample const& after) noexcept
{
    auto const machine = growth_percent(before.cpu_busy, after.cpu_busy, before.cpu_total, after.cpu_total);
    if (before.share_total == 0) // no limit, or one that was set just now
        return machine;
    return std::max(
        machine, growth_percent(before.share_busy, after.share_busy, before.share_total, after.share_total));
}

double load_of(LoadFormula formula, double cpu, HostSample const& sample) noexcept
{
    auto const gpu = sample.gpu.value_or(GpuSample());
    if (formula == LoadFormula::reference)
        return std::max(
            {cpu, (sample.swap_used + sample.memory_used + gpu.memory_controller) / 3, gpu.compute});
    return std::max({cpu, sample.memory_used, gpu.compute, gpu.memory_used});
}

void MovingAverage::add(double value) noexcept
{
    values_[count_++ % values_.size()] = value;
}

double MovingAverage::value() const noexcept
{
    auto const filled = std::min(count_, values_.size());
    if (filled == 0)
        return 0;
    return std::accumulate(values_.begin(), values_.begin() + static_cast<std::ptrdiff_t>(filled), 0.0) /
           static_cast<double>(filled);
}

} // namespace webots_cloud::core
