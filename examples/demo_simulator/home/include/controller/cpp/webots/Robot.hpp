// The part of Webots' C++ API that the demo simulator has: the C functions as classes.
#pragma once

#include "Compass.hpp"
#include "DistanceSensor.hpp"
#include "GPS.hpp"
#include "Motor.hpp"
#include "PositionSensor.hpp"

#include <webots/robot.h>

#include <map>
#include <memory>
#include <string>

namespace webots {

class Robot
{
public:
    Robot() { wb_robot_init(); }
    virtual ~Robot() { wb_robot_cleanup(); }
    Robot(Robot const&) = delete;
    Robot& operator=(Robot const&) = delete;

    virtual int step(int duration) { return wb_robot_step(duration); }
    double getBasicTimeStep() const { return wb_robot_get_basic_time_step(); }
    double getTime() const { return wb_robot_get_time(); }
    std::string getName() const { return wb_robot_get_name(); }

    // Devices belong to the robot. Null: there is none of this name and kind.
    Device* getDevice(std::string const& name) { return device(wb_robot_get_device(name.c_str())); }
    Compass* getCompass(std::string const& name) { return get<Compass>(name); }
    DistanceSensor* getDistanceSensor(std::string const& name) { return get<DistanceSensor>(name); }
    GPS* getGPS(std::string const& name) { return get<GPS>(name); }
    Motor* getMotor(std::string const& name) { return get<Motor>(name); }
    PositionSensor* getPositionSensor(std::string const& name) { return get<PositionSensor>(name); }
    int getNumberOfDevices() const { return wb_robot_get_number_of_devices(); }
    Device* getDeviceByIndex(int index) { return device(wb_robot_get_device_by_index(index)); }

private:
    template<class Kind>
    Kind* get(std::string const& name)
    {
        return dynamic_cast<Kind*>(getDevice(name));
    }

    Device* device(WbDeviceTag tag)
    {
        auto& known = devices_[tag];
        if (!known && tag != 0)
            known = make(tag);
        return known.get();
    }

    static std::unique_ptr<Device> make(WbDeviceTag tag)
    {
        switch (wb_device_get_node_type(tag)) {
        case WB_NODE_COMPASS:
            return std::make_unique<Compass>(tag);
        case WB_NODE_DISTANCE_SENSOR:
            return std::make_unique<DistanceSensor>(tag);
        case WB_NODE_GPS:
            return std::make_unique<GPS>(tag);
        case WB_NODE_POSITION_SENSOR:
            return std::make_unique<PositionSensor>(tag);
        case WB_NODE_ROTATIONAL_MOTOR:
            return std::make_unique<Motor>(tag);
        case WB_NODE_NO_NODE:
            break;
        }
        return nullptr;
    }

    std::map<WbDeviceTag, std::unique_ptr<Device>> devices_;
};

} // namespace webots
