#include "load_formula.hpp"

#include <algorithm>
#include <numeric>

namespace webots_cloud::core {

double cpu_percent(HostSample const& before, HostSample const& after) noexcept
{
    // Counters of a virtual machine may step back a little when it is moved: then nothing is known.
    if (after.cpu_total <= before.cpu_total || after.cpu_busy < before.cpu_busy)
        return 0;
    auto const busy = static_cast<double>(after.cpu_busy - before.cpu_busy);
    return std::min(100.0, 100 * busy / static_cast<double>(after.cpu_total - before.cpu_total));
}

double load_of(LoadFormula formula, double cpu, HostSample const& sample) noexcept
{
    auto const gpu = sample.gpu.value_or(GpuSample());
    if (formula == LoadFormula::reference)
        return std::max({cpu, (sample.swap_used + sample.memory_used + gpu.memory_controller) / 3, gpu.compute});
    return std::max({cpu, sample.memory_used, gpu.compute, gpu.memory_used});
}

void MovingAverage::add(double value) noexcept { values_[count_++ % values_.size()] = value; }

double MovingAverage::value() const noexcept
{
    auto const filled = std::min(count_, values_.size());
    if (filled == 0)
        return 0;
    return std::accumulate(values_.begin(), values_.begin() + static_cast<std::ptrdiff_t>(filled), 0.0) /
           static_cast<double>(filled);
}

} // namespace webots_cloud::core
