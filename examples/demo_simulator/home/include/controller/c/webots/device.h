#ifndef WEBOTS_DEVICE_H
#define WEBOTS_DEVICE_H

#include <webots/types.h>

WEBOTS_C_BEGIN

typedef enum {
    WB_NODE_NO_NODE,
    WB_NODE_COMPASS,
    WB_NODE_DISTANCE_SENSOR,
    WB_NODE_GPS,
    WB_NODE_POSITION_SENSOR,
    WB_NODE_ROTATIONAL_MOTOR
} WbNodeType;

char const* wb_device_get_name(WbDeviceTag device);
WbNodeType wb_device_get_node_type(WbDeviceTag device);

WEBOTS_C_END

#endif
