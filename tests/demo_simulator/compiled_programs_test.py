#!/usr/bin/python3
"""Robots that programs in C and C++ drive: compiled by the machine's make and compilers with what the simulator has for them."""

import json
import os
import shutil
import signal
import subprocess
import tempfile
import unittest

import simulator_process
from programs_test import PageTest, children
from simulator_process import PROJECTS, Simulator, wait_until

for program in ('make', 'cc', 'c++'):
    if not shutil.which(program):
        print(f'skipped: {program} is missing (Debian: make, g++)')
        raise SystemExit(77)

NAME = 'patrol_in_c'
START = """\
#include <webots/compass.h>
#include <webots/distance_sensor.h>
#include <webots/gps.h>
#include <webots/motor.h>
#include <webots/position_sensor.h>
#include <webots/robot.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
int main(void) {
"""
END = '\nreturn 0;\n}\n'
STEPS = 'wb_robot_init();\nprintf("%s\\n");\nwhile (wb_robot_step(32) != -1);'

CXX_PROGRAM = """\
#include <webots/Compass.hpp>
#include <webots/DistanceSensor.hpp>
#include <webots/GPS.hpp>
#include <webots/Motor.hpp>
#include <webots/PositionSensor.hpp>
#include <webots/Robot.hpp>
#include <cmath>
#include <iostream>
int main() {
  webots::Robot robot;
  int const step = static_cast<int>(robot.getBasicTimeStep());
  auto *gps = robot.getGPS("gps");
  auto *wheel = robot.getPositionSensor("left wheel sensor");
  gps->enable(step);
  wheel->enable(step);
  for (char const *name : {"left wheel motor", "right wheel motor"}) {
    robot.getMotor(name)->setPosition(2);
    robot.getMotor(name)->setVelocity(1);
  }
  for (int i = 0; i < 101; ++i)
    if (robot.step(step) == -1)
      return 1;
  std::cout << robot.getName() << " " << robot.getTime() << " " << std::round(wheel->getValue() * 1e6) / 1e6 << " "
            << std::round(gps->getValues()[0] * 1e6) / 1e6 << " " << (robot.getMotor("gps") == nullptr) << " "
            << (robot.getDevice("gps") == gps) << " " << robot.getDeviceByIndex(0)->getName() << std::endl;
}
"""


class CompiledPrograms(PageTest):
    def setUp(self):
        self.top = tempfile.mkdtemp(prefix='with a blank ')
        self.addCleanup(shutil.rmtree, self.top)
        self.project = shutil.copytree(os.path.join(PROJECTS, 'patrol'), os.path.join(self.top, 'patrol'))
        self.folder = os.path.join(self.project, 'controllers', NAME)
        # Where it is beside the program, as the simulation server finds it; its path has a blank, as others may have.
        self.home = os.path.join(self.top, 'home')
        os.symlink(os.path.join(os.path.dirname(simulator_process.binary), '..', 'share', 'webots_cloud', 'demo_simulator'), self.home)

    def write(self, text, file=NAME + '.c'):
        with open(os.path.join(self.folder, file), 'w') as to:
            to.write(text)

    def make(self):
        """As the simulation server calls it."""
        own = os.path.exists(os.path.join(self.folder, 'Makefile'))
        which = [] if own else ['-f', os.path.join(self.home, 'resources', 'Makefile.include')]
        return subprocess.run(['make', *which], cwd=self.folder, capture_output=True, text=True, timeout=60,
                              env={**os.environ, 'WEBOTS_HOME': self.home, 'LC_ALL': 'C'})

    def compile(self, text=None):
        if text is not None:
            self.write(text)
        made = self.make()
        self.assertEqual((made.returncode, made.stderr), (0, ''))
        return made.stdout

    def simulator(self, world=NAME):
        simulator = Simulator(world=os.path.join(self.project, 'worlds', world + '.wbt'))
        self.addCleanup(simulator.end)
        return simulator.ready()

    async def place(self, page):
        """Where the robot is, while the simulation is paused: x and y."""
        await page.socket.send('step')
        state = json.loads((await page.frame('application/json:')).removeprefix('application/json:'))
        return [float(number) for number in state['updates'][0]['translation'].split()[:2]]

    async def run_program(self, statements, expected):
        self.compile(START + statements + END)
        page = await self.page(self.simulator())
        return await page.line(expected), page

    async def test_the_demo_program_drives_as_the_one_in_python_does(self):
        self.assertEqual(self.compile(), f'# compiling {NAME}.c\n# linking {NAME}\n')
        page = await self.page(self.simulator(), state='fast:4000')
        await page.line('stdout:robot guard: on patrol')
        self.assertEqual(page.console[0], f"stdout:INFO: '{NAME}' controller: starting {NAME}")
        await page.frame('pause: 4')
        place = await self.place(page)
        self.assertFalse([line for line in page.console if line.startswith('stderr:')])
        page = await self.page(self.simulator(world='patrol'), state='fast:4000')
        await page.frame('pause: 4')
        for ours, of_python in zip(place, await self.place(page), strict=True):
            self.assertAlmostEqual(ours, of_python, delta=0.01)

    async def test_before_it_is_compiled_the_robot_stands_and_a_reload_takes_the_program(self):
        page = await self.page(self.simulator(), state='fast:3200')
        self.assertEqual(await page.line('compiled'), f"stderr:WARNING: '{NAME}' controller is not compiled yet, so its robot stands: "
                                                      "press Run in the editor, which compiles it where this machine can.")
        await page.frame('pause: 32')
        self.assertEqual(await self.place(page), [-0.55, -0.55])
        self.compile()
        await page.socket.send('reload')
        await page.line('stdout:robot guard: on patrol')

    async def test_reload_and_reset_take_a_program_that_was_compiled_while_the_old_one_ran(self):
        self.compile(START + STEPS % 'first' + END)
        simulator = self.simulator()
        page = await self.page(simulator)
        await page.line('stdout:first')
        self.compile(START + STEPS % 'second' + END)
        await page.socket.send('reload')
        await page.line('stdout:second')
        self.compile(START + STEPS % 'third' + END)
        await page.socket.send('reset')
        await page.line('stdout:third')
        wait_until(lambda: len(children(simulator.process.pid)) == 1, lambda: children(simulator.process.pid))

    async def test_devices_measure_what_is_there(self):
        _, page = await self.run_program("""
wb_robot_init();
int step = (int)wb_robot_get_basic_time_step();
WbDeviceTag front = wb_robot_get_device("ds3"), gps = wb_robot_get_device("gps"), compass = wb_robot_get_device("compass");
WbDeviceTag wheel = wb_robot_get_device("left wheel sensor"), wings = wb_robot_get_device("wings");
printf("before %g %g\\n", wb_distance_sensor_get_value(front), wb_gps_get_values(gps)[2]);
wb_distance_sensor_enable(front, step);
wb_gps_enable(gps, step);
wb_compass_enable(compass, step);
wb_position_sensor_enable(wheel, step);
for (int i = 0; i < 2; ++i) {
  wb_motor_set_position(wb_robot_get_device_by_index(i), 2);
  wb_motor_set_velocity(wb_robot_get_device_by_index(i), 1);
}
wb_motor_set_velocity(gps, 7);
wb_motor_set_velocity(wb_robot_get_device_by_index(0), -70);
wb_motor_set_velocity(wb_robot_get_device_by_index(0), 1);
wb_robot_step(step);
const double *at = wb_gps_get_values(gps), *north = wb_compass_get_values(compass);
printf("first %s %g %g %g %g %g %g %d\\n", wb_robot_get_name(), wb_robot_get_time(), wb_distance_sensor_get_value(front), at[0],
       at[1], north[0], north[1], wings);
for (int i = 0; i < 100; ++i)
  wb_robot_step(step);
printf("then %.3f %.6f %.6f %.6f\\n", wb_robot_get_time(), wb_position_sensor_get_value(wheel), at[0], at[1]);
""", 'stdout:then')
        self.assertIn('stdout:before nan nan', page.console)
        self.assertIn('stdout:first guard 0.032 0.45 -0.54888 -0.55 0 1 0', page.console)
        self.assertIn('stdout:then 3.232 2.000000 -0.480000 -0.550000', page.console)
        warnings = '\n'.join(line for line in page.console if line.startswith('stderr:'))
        self.assertRegex(warnings, r'the robot has no device "wings"; it has left wheel motor, .*, right wheel sensor\.')
        self.assertIn('wb_motor_set_velocity() has no effect: it was not given a device of its kind.', warnings)
        self.assertIn('left wheel motor: it can turn by 20 radians per second at most, -70 is too much.', warnings)

    async def test_a_program_in_cxx_without_a_makefile_drives(self):
        for file in ('Makefile', NAME + '.c'):
            os.remove(os.path.join(self.folder, file))
        self.write(CXX_PROGRAM, 'main.cpp')
        self.assertEqual(self.compile(), f'# compiling main.cpp\n# linking {NAME}\n')
        page = await self.page(self.simulator())
        self.assertEqual(await page.line('stdout:guard'), 'stdout:guard 3.232 2 -0.48 1 1 left wheel motor')
        await page.line(f"INFO: '{NAME}' controller exited successfully")

    async def test_the_compiler_names_file_and_line_of_a_mistake_and_the_old_program_stays(self):
        self.compile(START + STEPS % 'old' + END)
        self.write(START + 'wb_robot_init()' + END)
        made = self.make()
        self.assertNotEqual(made.returncode, 0)
        line = START.count('\n') + 1
        self.assertRegex(made.stderr, rf'(?m)^{NAME}\.c:{line}:\d+: error: ')
        page = await self.page(self.simulator())
        await page.line('stdout:old')

    async def test_what_is_called_but_does_not_exist_is_named(self):
        self.write(START + 'wb_robot_fly();' + END)
        made = self.make()
        self.assertNotEqual(made.returncode, 0)
        self.assertIn('wb_robot_fly', made.stderr)

    async def test_the_console_says_how_a_program_has_ended(self):
        ends = f"'{NAME}' controller "
        for statements, expected in (('wb_robot_init();', f'stdout:INFO: {ends}exited successfully. Its robot stands.'),
                                     ('exit(3);', f'stderr:WARNING: {ends}exited with status 3. Its robot stands.'),
                                     ('abort();', f'stderr:WARNING: {ends}was ended by signal {signal.SIGABRT} (Aborted). Its robot stands.')):
            with self.subTest(statements):
                line, page = await self.run_program('printf("last words"); ' + statements, 'Its robot stands')
                self.assertEqual(line, expected)
                self.assertIn('stdout:last words', page.console)
                await page.frame('application/json:')  # the simulation goes on

    async def test_a_function_before_init_says_what_to_do(self):
        line, _ = await self.run_program('wb_robot_step(32);', 'Error')
        self.assertEqual(line, 'stderr:Error: wb_robot_step() comes too early: call wb_robot_init() before it.')

    async def test_an_executable_that_is_no_program_is_told(self):
        self.write('nothing', NAME)
        os.chmod(os.path.join(self.folder, NAME), 0o755)
        page = await self.page(self.simulator())
        await page.line('stderr:Exec format error')
        await page.line(f"WARNING: '{NAME}' controller exited with status 127")

    async def test_one_that_computes_for_ever_has_time_stand_and_is_ended_by_a_reset(self):
        line, page = await self.run_program('wb_robot_init(); for (;;);', 'the simulation waits')
        self.assertIn(f"'{NAME}' controller, which has not called robot.step()", line)
        self.compile(START + STEPS % 'mended' + END)
        await page.socket.send('reset')
        await page.line('stdout:mended')

    async def test_programs_have_what_they_need_and_no_sockets_of_the_simulator(self):
        _, page = await self.run_program('fflush(stdout); execlp("python3", "python3", "-c", '
                                         '"import os; print(\'open\', sorted(os.listdir(\'/proc/self/fd\'), key=int), os.getcwd())", NULL);',
                                         'stdout:open')
        self.assertIn(f"stdout:open ['0', '1', '2', '3', '4'] {self.folder}", page.console)  # 4 is the folder that is listed

    async def test_what_drives_no_robot_is_just_started(self):
        """Executables of supervisors: time does not wait for them. That of a robot is started once."""
        script = '#!/bin/sh\necho "$0" >> "started $$"\nexec sleep 60\n'
        for name in (NAME, 'watch'):
            os.makedirs(os.path.join(self.project, 'controllers', name), exist_ok=True)
            path = os.path.join(self.project, 'controllers', name, name)
            with open(path, 'w') as file:
                file.write(script)
            os.chmod(path, 0o755)
        with open(os.path.join(self.project, 'worlds', NAME + '.wbt'), 'a') as world:
            world.write('Robot { name "watcher" controller "watch" supervisor TRUE }\n')
        simulator = self.simulator()
        page = await self.page(simulator)
        await page.line('the simulation waits')
        wait_until(lambda: all(self.starts(name) for name in (NAME, 'watch')), 'both were started')
        self.assertEqual([len(self.starts(name)) for name in (NAME, 'watch')], [1, 1])
        drives, watches = (int(self.starts(name)[0].split()[1]) for name in (NAME, 'watch'))
        self.addCleanup(os.kill, watches, signal.SIGKILL)
        os.kill(drives, signal.SIGKILL)
        await page.line('was ended by signal 9')
        await page.frame('application/json:{"time":320')  # while the other runs

    def starts(self, name):
        return [file for file in os.listdir(os.path.join(self.project, 'controllers', name)) if file.startswith('started')]


if __name__ == '__main__':
    simulator_process.main()
