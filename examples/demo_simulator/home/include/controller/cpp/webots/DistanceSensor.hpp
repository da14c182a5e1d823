#pragma once

#include "Device.hpp"

#include <webots/distance_sensor.h>

namespace webots {

class DistanceSensor : public Device
{
public:
    using Device::Device;
    void enable(int samplingPeriod) { wb_distance_sensor_enable(getTag(), samplingPeriod); }
    void disable() { wb_distance_sensor_disable(getTag()); }
    int getSamplingPeriod() const { return wb_distance_sensor_get_sampling_period(getTag()); }
    double getValue() const { return wb_distance_sensor_get_value(getTag()); }
    double getMinValue() const { return wb_distance_sensor_get_min_value(getTag()); }
    double getMaxValue() const { return wb_distance_sensor_get_max_value(getTag()); }
};

} // namespace webots
