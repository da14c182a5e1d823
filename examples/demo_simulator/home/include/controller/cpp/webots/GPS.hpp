#pragma once

#include "Device.hpp"

#include <webots/gps.h>

namespace webots {

class GPS : public Device
{
public:
    using Device::Device;
    void enable(int samplingPeriod) { wb_gps_enable(getTag(), samplingPeriod); }
    void disable() { wb_gps_disable(getTag()); }
    int getSamplingPeriod() const { return wb_gps_get_sampling_period(getTag()); }
    double const* getValues() const { return wb_gps_get_values(getTag()); }
};

} // namespace webots
