/* A motor turns to a position, at first 0; after wb_motor_set_position(motor, INFINITY) it turns on at the velocity that is set. */
#ifndef WEBOTS_MOTOR_H
#define WEBOTS_MOTOR_H

#include <webots/types.h>

WEBOTS_C_BEGIN

void wb_motor_set_position(WbDeviceTag motor, double position); /* radians */
void wb_motor_set_velocity(WbDeviceTag motor, double velocity); /* radians per second */
double wb_motor_get_target_position(WbDeviceTag motor);
double wb_motor_get_velocity(WbDeviceTag motor);
double wb_motor_get_max_velocity(WbDeviceTag motor);

WEBOTS_C_END

#endif
