// How measurements of the machine become the number that `/load` answers (protocol section 4.2).
#pragma once

#include <webots_cloud/transport/host_metrics.hpp>

#include <array>
#include <cstddef>

namespace webots_cloud::core {

/// How the load is computed from the measurements.
enum class LoadFormula
{
    /// max(CPU, (swap + RAM + GPU memory controller) / 3, GPU compute), as the newest Python server has it: a
    /// machine whose memory is exhausted still offers itself, because two idle figures outweigh it.
    reference,
    /// max(CPU, RAM, GPU compute, GPU memory): each resource alone can fill the machine. The default.
    strict
};

/// Percent of the processors' time that was used between two samples, or of what the control group may use,
/// whichever is higher; 0 when no time passed.
double cpu_percent(HostSample const& before, HostSample const& after) noexcept;

/// The load of one sample, in percent.
double load_of(LoadFormula formula, double cpu, HostSample const& sample) noexcept;

/// The mean of the last five values.
class MovingAverage
{
public:
    void add(double value) noexcept;

    /// 0 before the first value.
    double value() const noexcept;

private:
    std::array<double, 5> values_{};
    std::size_t count_ = 0;
};

} // namespace webots_cloud::core
