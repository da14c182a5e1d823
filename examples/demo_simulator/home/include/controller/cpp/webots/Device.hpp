#pragma once

#include <webots/device.h>

#include <string>

namespace webots {

class Device
{
public:
    explicit Device(WbDeviceTag tag) : tag_(tag) {}
    virtual ~Device() = default;
    Device(Device const&) = delete;
    Device& operator=(Device const&) = delete;

    std::string getName() const { return wb_device_get_name(tag_); }
    WbDeviceTag getTag() const { return tag_; }

private:
    WbDeviceTag tag_;
};

} // namespace webots
