#pragma once

#include "Device.hpp"

#include <webots/position_sensor.h>

namespace webots {

class PositionSensor : public Device
{
public:
    using Device::Device;
    void enable(int samplingPeriod) { wb_position_sensor_enable(getTag(), samplingPeriod); }
    void disable() { wb_position_sensor_disable(getTag()); }
    int getSamplingPeriod() const { return wb_position_sensor_get_sampling_period(getTag()); }
    double getValue() const { return wb_position_sensor_get_value(getTag()); }
};

} // namespace webots
