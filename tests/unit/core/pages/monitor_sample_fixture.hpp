// A sample of the monitor with a value of its own in each member.
#pragma once

#include "core/pages/monitor_sample.hpp"

#include <webots_cloud/time.hpp>

#include <chrono>

namespace webots_cloud::monitor_test {

inline constexpr WallTime wall(std::chrono::seconds(1'700'000'000));

inline core::MonitorSample sample()
{
    core::MonitorSample sample;
    sample.running = 3;
    sample.idle = 1;
    sample.cpu = 12.34;
    sample.memory = 50;
    sample.gpu_compute = 7;
    sample.gpu_memory_controller = 2;
    sample.gpu_memory = 66.66;
    sample.disk = 81.25;
    sample.sent = 1.23456;
    sample.received = 0.0004;
    return sample;
}

} // namespace webots_cloud::monitor_test
