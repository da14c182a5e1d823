/* Metres to what is ahead. A sensor measures from the step after enable on. */
#ifndef WEBOTS_DISTANCE_SENSOR_H
#define WEBOTS_DISTANCE_SENSOR_H

#include <webots/types.h>

WEBOTS_C_BEGIN

void wb_distance_sensor_enable(WbDeviceTag sensor, int sampling_period); /* milliseconds */
void wb_distance_sensor_disable(WbDeviceTag sensor);
int wb_distance_sensor_get_sampling_period(WbDeviceTag sensor);
double wb_distance_sensor_get_value(WbDeviceTag sensor);
double wb_distance_sensor_get_min_value(WbDeviceTag sensor);
double wb_distance_sensor_get_max_value(WbDeviceTag sensor);

WEBOTS_C_END

#endif
