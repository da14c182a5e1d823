#pragma once

#include "Device.hpp"

#include <webots/compass.h>

namespace webots {

class Compass : public Device
{
public:
    using Device::Device;
    void enable(int samplingPeriod) { wb_compass_enable(getTag(), samplingPeriod); }
    void disable() { wb_compass_disable(getTag()); }
    int getSamplingPeriod() const { return wb_compass_get_sampling_period(getTag()); }
    double const* getValues() const { return wb_compass_get_values(getTag()); }
};

} // namespace webots
