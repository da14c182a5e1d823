#pragma once

#include "Device.hpp"

#include <webots/motor.h>

namespace webots {

class Motor : public Device
{
public:
    using Device::Device;
    void setPosition(double position) { wb_motor_set_position(getTag(), position); }
    void setVelocity(double velocity) { wb_motor_set_velocity(getTag(), velocity); }
    double getTargetPosition() const { return wb_motor_get_target_position(getTag()); }
    double getVelocity() const { return wb_motor_get_velocity(getTag()); }
    double getMaxVelocity() const { return wb_motor_get_max_velocity(getTag()); }
};

} // namespace webots
