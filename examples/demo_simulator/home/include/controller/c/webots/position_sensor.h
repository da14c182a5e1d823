/* The angle of a wheel in radians. A sensor measures from the step after enable on. */
#ifndef WEBOTS_POSITION_SENSOR_H
#define WEBOTS_POSITION_SENSOR_H

#include <webots/types.h>

WEBOTS_C_BEGIN

void wb_position_sensor_enable(WbDeviceTag sensor, int sampling_period); /* milliseconds */
void wb_position_sensor_disable(WbDeviceTag sensor);
int wb_position_sensor_get_sampling_period(WbDeviceTag sensor);
double wb_position_sensor_get_value(WbDeviceTag sensor);

WEBOTS_C_END

#endif
