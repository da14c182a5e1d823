// HostMetrics of a machine whose state the test sets.
#pragma once

#include <webots_cloud/transport/host_metrics.hpp>

namespace webots_cloud::testing {

/// A machine that is as busy as the test says.
class FixedMetrics final : public HostMetrics
{
public:
    HostSample sample() override
    {
        next.cpu_total += 100;
        next.cpu_busy += cpu;
        return next;
    }
    HostDescription description() override { return host; }

    HostSample next;       ///< The next sample; the processor's counters advance by themselves.
    std::uint64_t cpu = 0; ///< Percent busy between samples.
    HostDescription host;
};

} // namespace webots_cloud::testing
