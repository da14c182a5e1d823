/* Where the robot is, in metres. A sensor measures from the step after enable on. */
#ifndef WEBOTS_GPS_H
#define WEBOTS_GPS_H

#include <webots/types.h>

WEBOTS_C_BEGIN

void wb_gps_enable(WbDeviceTag sensor, int sampling_period); /* milliseconds */
void wb_gps_disable(WbDeviceTag sensor);
int wb_gps_get_sampling_period(WbDeviceTag sensor);
double const* wb_gps_get_values(WbDeviceTag sensor); /* three */

WEBOTS_C_END

#endif
