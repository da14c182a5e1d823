/* The part of Webots' C API that the demo simulator has; resources/Makefile.include compiles it into each
 * program.
 *
 * Program and simulator speak line by line over the socket 3, as controller.py does: first comes `robot
 * <basic time step> <name>`; after each `step <ms> <position> <velocity> <position> <velocity>` of the left
 * and the right wheel, and once that much time is simulated,
 * `<time> <7 distances> <x> <y> <heading> <left angle> <right angle>`. The simulation waits meanwhile. */
#define _GNU_SOURCE
#include <webots/compass.h>
#include <webots/device.h>
#include <webots/distance_sensor.h>
#include <webots/gps.h>
#include <webots/motor.h>
#include <webots/position_sensor.h>
#include <webots/robot.h>

#include <sys/socket.h>
#include <unistd.h>

#include <errno.h>
#include <locale.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STEPS 3 /* the socket */
#define MAX_VELOCITY 20.0
#define RANGE 0.45
#define MEASURED 13 /* numbers of an answer */
#define LONGEST_LINE 1024
#define LONGEST_STEP 1000000000

struct Device
{
    char const* name;
    WbNodeType type;
    int measured; /* which number of an answer is its first */
    int period;
    double values[3];
    double position; /* of motors: what they were told */
    double velocity;
};

static struct Device devices[] = {
    {.name = "left wheel motor", .type = WB_NODE_ROTATIONAL_MOTOR, .velocity = MAX_VELOCITY},
    {.name = "right wheel motor", .type = WB_NODE_ROTATIONAL_MOTOR, .velocity = MAX_VELOCITY},
    {.name = "ds0", .type = WB_NODE_DISTANCE_SENSOR, .measured = 1},
    {.name = "ds1", .type = WB_NODE_DISTANCE_SENSOR, .measured = 2},
    {.name = "ds2", .type = WB_NODE_DISTANCE_SENSOR, .measured = 3},
    {.name = "ds3", .type = WB_NODE_DISTANCE_SENSOR, .measured = 4},
    {.name = "ds4", .type = WB_NODE_DISTANCE_SENSOR, .measured = 5},
    {.name = "ds5", .type = WB_NODE_DISTANCE_SENSOR, .measured = 6},
    {.name = "ds6", .type = WB_NODE_DISTANCE_SENSOR, .measured = 7},
    {.name = "gps", .type = WB_NODE_GPS, .measured = 8},
    {.name = "compass", .type = WB_NODE_COMPASS, .measured = 10},
    {.name = "left wheel sensor", .type = WB_NODE_POSITION_SENSOR, .measured = 11},
    {.name = "right wheel sensor", .type = WB_NODE_POSITION_SENSOR, .measured = 12},
};
enum
{
    DEVICES = sizeof devices / sizeof devices[0]
};

static int has_begun;
static int time_step;
static double now; /* milliseconds */
static char robot_name[LONGEST_LINE];
static locale_t plain; /* numbers have a point, whatever locale the program sets */

/* What is printed is in the console at once, also if the program crashes then. */
__attribute__((constructor)) static void print_at_once(void)
{
    setvbuf(stdout, NULL, _IONBF, 0);
}

/* The simulator sends one line at a time. 0: the simulation is over. */
static int receive(char* line)
{
    int size = 0;
    while (size < LONGEST_LINE) {
        ssize_t const got = read(STEPS, line + size, (size_t)(LONGEST_LINE - size));
        if (got < 0 && errno == EINTR)
            continue;
        if (got <= 0)
            return 0;
        size += (int)got;
        if (line[size - 1] == '\n') {
            line[size - 1] = '\0';
            return 1;
        }
    }
    return 0;
}

static void measure(struct Device* device, double const* numbers)
{
    double const* measured = numbers + device->measured;
    if (device->period <= 0)
        return;
    if (device->type == WB_NODE_COMPASS) { /* where north is */
        device->values[0] = sin(measured[0]);
        device->values[1] = cos(measured[0]);
        device->values[2] = 0;
        return;
    }
    device->values[0] = measured[0];
    if (device->type == WB_NODE_GPS) {
        device->values[1] = measured[1];
        device->values[2] = 0;
    }
}

static void forget(struct Device* device)
{
    device->values[0] = device->values[1] = device->values[2] = NAN;
}

/* Ends the program if `function` comes too early: in Webots nothing good would come of it. */
static void must_have_begun(char const* function)
{
    if (has_begun)
        return;
    fprintf(stderr, "Error: %s() comes too early: call wb_robot_init() before it.\n", function);
    exit(EXIT_FAILURE);
}

static struct Device* find(WbDeviceTag tag, WbNodeType type, char const* function)
{
    must_have_begun(function);
    if (tag >= 1 && tag <= DEVICES && (type == WB_NODE_NO_NODE || devices[tag - 1].type == type))
        return &devices[tag - 1];
    fprintf(stderr, "Warning: %s() has no effect: it was not given a device of its kind.\n", function);
    return NULL;
}

int wb_robot_init(void)
{
    char line[LONGEST_LINE];
    int name_begins = 0;
    if (has_begun)
        return 1;
    if (!receive(line) || sscanf(line, "robot %d %n", &time_step, &name_begins) != 1 || name_begins == 0) {
        fprintf(stderr, "Error: this program was not started by a simulation.\n");
        exit(EXIT_FAILURE);
    }
    strcpy(robot_name, line + name_begins);
    plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    for (int i = 0; i < DEVICES; ++i)
        forget(&devices[i]);
    has_begun = 1;
    return 1;
}

void wb_robot_cleanup(void) {}

static int ask_for_step(int duration)
{
    char line[LONGEST_LINE];
    struct Device const* left = &devices[0];
    struct Device const* right = &devices[1];
    int const size = snprintf(line, sizeof line, "step %d %.17g %.17g %.17g %.17g\n", duration,
                              left->position, left->velocity, right->position, right->velocity);
    return send(STEPS, line, (size_t)size, MSG_NOSIGNAL) == size;
}

static int take_answer(void)
{
    char line[LONGEST_LINE];
    double numbers[MEASURED];
    char* rest = line;
    if (!receive(line))
        return 0;
    for (int i = 0; i < MEASURED; ++i)
        numbers[i] = strtod(rest, &rest);
    now = numbers[0];
    for (int i = 0; i < DEVICES; ++i)
        measure(&devices[i], numbers);
    return 1;
}

int wb_robot_step(int duration)
{
    must_have_begun(__func__);
    duration = duration < 1 ? 1 : duration > LONGEST_STEP ? LONGEST_STEP : duration;
    locale_t const theirs = uselocale(plain);
    int const goes_on = ask_for_step(duration) && take_answer();
    uselocale(theirs);
    return goes_on ? 0 : -1;
}

double wb_robot_get_basic_time_step(void)
{
    must_have_begun(__func__);
    return time_step;
}

double wb_robot_get_time(void)
{
    must_have_begun(__func__);
    return now / 1000;
}

char const* wb_robot_get_name(void)
{
    must_have_begun(__func__);
    return robot_name;
}

int wb_robot_get_number_of_devices(void)
{
    must_have_begun(__func__);
    return DEVICES;
}

WbDeviceTag wb_robot_get_device_by_index(int index)
{
    must_have_begun(__func__);
    return index >= 0 && index < DEVICES ? (WbDeviceTag)(index + 1) : 0;
}

WbDeviceTag wb_robot_get_device(char const* name)
{
    must_have_begun(__func__);
    for (int i = 0; i < DEVICES; ++i)
        if (strcmp(devices[i].name, name) == 0)
            return (WbDeviceTag)(i + 1);
    fprintf(stderr, "Warning: the robot has no device \"%s\"; it has ", name);
    for (int i = 0; i < DEVICES; ++i)
        fprintf(stderr, "%s%s", devices[i].name, i + 1 < DEVICES ? ", " : ".\n");
    return 0;
}

char const* wb_device_get_name(WbDeviceTag tag)
{
    struct Device const* device = find(tag, WB_NODE_NO_NODE, __func__);
    return device ? device->name : NULL;
}

WbNodeType wb_device_get_node_type(WbDeviceTag tag)
{
    struct Device const* device = find(tag, WB_NODE_NO_NODE, __func__);
    return device ? device->type : WB_NODE_NO_NODE;
}

/* Motors */

void wb_motor_set_position(WbDeviceTag tag, double position)
{
    struct Device* motor = find(tag, WB_NODE_ROTATIONAL_MOTOR, __func__);
    if (!motor)
        return;
    if (isnan(position)) {
        fprintf(stderr, "Warning: %s: wb_motor_set_position(NAN) has no effect.\n", motor->name);
        return;
    }
    motor->position = position;
}

void wb_motor_set_velocity(WbDeviceTag tag, double velocity)
{
    struct Device* motor = find(tag, WB_NODE_ROTATIONAL_MOTOR, __func__);
    if (!motor)
        return;
    if (isnan(velocity)) {
        fprintf(stderr, "Warning: %s: wb_motor_set_velocity(NAN) has no effect.\n", motor->name);
        return;
    }
    if (fabs(velocity) > MAX_VELOCITY) {
        fprintf(stderr, "Warning: %s: it can turn by %g radians per second at most, %g is too much.\n",
                motor->name, MAX_VELOCITY, velocity);
        velocity = copysign(MAX_VELOCITY, velocity);
    }
    motor->velocity = velocity;
}

double wb_motor_get_target_position(WbDeviceTag tag)
{
    struct Device const* motor = find(tag, WB_NODE_ROTATIONAL_MOTOR, __func__);
    return motor ? motor->position : NAN;
}

double wb_motor_get_velocity(WbDeviceTag tag)
{
    struct Device const* motor = find(tag, WB_NODE_ROTATIONAL_MOTOR, __func__);
    return motor ? motor->velocity : NAN;
}

double wb_motor_get_max_velocity(WbDeviceTag tag)
{
    return find(tag, WB_NODE_ROTATIONAL_MOTOR, __func__) ? MAX_VELOCITY : NAN;
}

/* Sensors: what all have in common, and then one after the other. */

static void set_period(struct Device* sensor, int period)
{
    if (!sensor)
        return;
    sensor->period = period > 0 ? period : 0;
    if (sensor->period == 0)
        forget(sensor);
}

static int period_of(struct Device const* sensor)
{
    return sensor ? sensor->period : 0;
}

static double const* values_of(struct Device const* sensor)
{
    static double const nothing[] = {NAN, NAN, NAN};
    return sensor ? sensor->values : nothing;
}

void wb_distance_sensor_enable(WbDeviceTag tag, int sampling_period)
{
    set_period(find(tag, WB_NODE_DISTANCE_SENSOR, __func__), sampling_period);
}

void wb_distance_sensor_disable(WbDeviceTag tag)
{
    set_period(find(tag, WB_NODE_DISTANCE_SENSOR, __func__), 0);
}

int wb_distance_sensor_get_sampling_period(WbDeviceTag tag)
{
    return period_of(find(tag, WB_NODE_DISTANCE_SENSOR, __func__));
}

double wb_distance_sensor_get_value(WbDeviceTag tag)
{
    return *values_of(find(tag, WB_NODE_DISTANCE_SENSOR, __func__));
}

double wb_distance_sensor_get_min_value(WbDeviceTag tag)
{
    return find(tag, WB_NODE_DISTANCE_SENSOR, __func__) ? 0 : NAN;
}

double wb_distance_sensor_get_max_value(WbDeviceTag tag)
{
    return find(tag, WB_NODE_DISTANCE_SENSOR, __func__) ? RANGE : NAN;
}

void wb_position_sensor_enable(WbDeviceTag tag, int sampling_period)
{
    set_period(find(tag, WB_NODE_POSITION_SENSOR, __func__), sampling_period);
}

void wb_position_sensor_disable(WbDeviceTag tag)
{
    set_period(find(tag, WB_NODE_POSITION_SENSOR, __func__), 0);
}

int wb_position_sensor_get_sampling_period(WbDeviceTag tag)
{
    return period_of(find(tag, WB_NODE_POSITION_SENSOR, __func__));
}

double wb_position_sensor_get_value(WbDeviceTag tag)
{
    return *values_of(find(tag, WB_NODE_POSITION_SENSOR, __func__));
}

void wb_gps_enable(WbDeviceTag tag, int sampling_period)
{
    set_period(find(tag, WB_NODE_GPS, __func__), sampling_period);
}

void wb_gps_disable(WbDeviceTag tag)
{
    set_period(find(tag, WB_NODE_GPS, __func__), 0);
}

int wb_gps_get_sampling_period(WbDeviceTag tag)
{
    return period_of(find(tag, WB_NODE_GPS, __func__));
}

double const* wb_gps_get_values(WbDeviceTag tag)
{
    return values_of(find(tag, WB_NODE_GPS, __func__));
}

void wb_compass_enable(WbDeviceTag tag, int sampling_period)
{
    set_period(find(tag, WB_NODE_COMPASS, __func__), sampling_period);
}

void wb_compass_disable(WbDeviceTag tag)
{
    set_period(find(tag, WB_NODE_COMPASS, __func__), 0);
}

int wb_compass_get_sampling_period(WbDeviceTag tag)
{
    return period_of(find(tag, WB_NODE_COMPASS, __func__));
}

double const* wb_compass_get_values(WbDeviceTag tag)
{
    return values_of(find(tag, WB_NODE_COMPASS, __func__));
}
