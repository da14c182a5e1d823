/* Where north is, seen from the robot. A sensor measures from the step after enable on. */
#ifndef WEBOTS_COMPASS_H
#define WEBOTS_COMPASS_H

#include <webots/types.h>

WEBOTS_C_BEGIN

void wb_compass_enable(WbDeviceTag sensor, int sampling_period); /* milliseconds */
void wb_compass_disable(WbDeviceTag sensor);
int wb_compass_get_sampling_period(WbDeviceTag sensor);
double const* wb_compass_get_values(WbDeviceTag sensor); /* three */

WEBOTS_C_END

#endif
