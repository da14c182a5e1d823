/* The part of Webots' C API that the demo simulator has. One program has one robot. */
#ifndef WEBOTS_ROBOT_H
#define WEBOTS_ROBOT_H

#include <webots/types.h>

WEBOTS_C_BEGIN

int wb_robot_init(void); /* before everything else; 1 */
void wb_robot_cleanup(void);

/* Has the robot do for so many milliseconds what the motors were told. -1: the simulation is over. */
int wb_robot_step(int duration);

double wb_robot_get_basic_time_step(void); /* milliseconds */
double wb_robot_get_time(void);            /* simulated seconds */
char const* wb_robot_get_name(void);

WbDeviceTag wb_robot_get_device(char const* name);
int wb_robot_get_number_of_devices(void);
WbDeviceTag wb_robot_get_device_by_index(int index);

WEBOTS_C_END

#endif
