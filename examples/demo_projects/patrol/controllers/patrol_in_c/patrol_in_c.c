/* Drives a robot round a block. Change what you like, and press Run. */
#include <webots/distance_sensor.h>
#include <webots/motor.h>
#include <webots/robot.h>

#include <math.h>
#include <stdio.h>

#define SENSORS 7
#define AHEAD (SENSORS / 2)
#define RANGE 0.45 /* metres */
#define CRUISE 8.0 /* radians per second */

static const double WEIGHTS[AHEAD] = {0.15, 0.55, 0.8};

static WbDeviceTag sensors[SENSORS];
static WbDeviceTag left_motor, right_motor;

static WbDeviceTag find_motor(const char *name) {
  const WbDeviceTag motor = wb_robot_get_device(name);
  wb_motor_set_position(motor, INFINITY);
  wb_motor_set_velocity(motor, 0);
  return motor;
}

static void find_devices(int step) {
  for (int i = 0; i < SENSORS; ++i) {
    char name[8];
    snprintf(name, sizeof name, "ds%d", i);
    sensors[i] = wb_robot_get_device(name);
    wb_distance_sensor_enable(sensors[i], step);
  }
  left_motor = find_motor("left wheel motor");
  right_motor = find_motor("right wheel motor");
}

/* What is on the left, ahead and on the right: 0 far away, 1 here. */
static void look(double *left, double *front, double *right) {
  double near[SENSORS];
  for (int i = 0; i < SENSORS; ++i)
    near[i] = 1 - wb_distance_sensor_get_value(sensors[i]) / RANGE;
  *left = *right = 0;
  for (int i = 0; i < AHEAD; ++i) {
    *left += WEIGHTS[i] * near[i];
    *right += WEIGHTS[i] * near[SENSORS - 1 - i];
  }
  *front = fmax(near[AHEAD], 0.8 * fmax(near[AHEAD - 1], near[AHEAD + 1]));
}

int main(void) {
  wb_robot_init();
  const int step = (int)wb_robot_get_basic_time_step();
  find_devices(step);
  printf("robot %s: on patrol\n", wb_robot_get_name());

  int escape = 0; /* 1: to the left, -1: to the right */
  while (wb_robot_step(step) != -1) {
    double left, front, right;
    look(&left, &front, &right);
    if (front > 0.45 && escape == 0) {
      escape = right >= left ? 1 : -1;
      printf("robot %s: obstacle ahead\n", wb_robot_get_name());
    } else if (front < 0.15)
      escape = 0;
    const double turn = escape ? 0.6 * escape : fmax(-0.8, fmin(0.8, right - left));
    const double forward = fmax(0.08, 1 - 1.1 * front);
    wb_motor_set_velocity(left_motor, CRUISE * (forward - turn));
    wb_motor_set_velocity(right_motor, CRUISE * (forward + turn));
  }
  wb_robot_cleanup();
  return 0;
}
