#!/usr/bin/python3
"""Robots that Python programs drive: lessons and their solutions, programs that are wrong, and programs that mean harm."""

import asyncio
import os
import shutil
import signal
import tempfile
import unittest

import simulator_process
from protocol_test import connect
from simulator_process import PATIENCE, PROJECTS, Simulator, wait_until
from support.lessons import SOLUTIONS, solved

LESSONS = os.path.join(PROJECTS, 'lessons')
START = "from controller import Robot\nrobot = Robot()\nstep = int(robot.getBasicTimeStep())\n"


class Page:
    """A browser's page that keeps the lines of its console."""

    def __init__(self, socket):
        self.socket = socket
        self.console = []

    async def line(self, part):
        """The first line of the console, from now on, that has this in it."""
        while True:
            text = await asyncio.wait_for(self.socket.recv(), PATIENCE)
            if text.startswith(('stdout:', 'stderr:')):
                self.console.append(text)
                if part in text:
                    return text

    async def frame(self, beginning):
        while True:
            text = await asyncio.wait_for(self.socket.recv(), PATIENCE)
            if text.startswith(beginning):
                return text


def children(process):
    with open(f'/proc/{process}/task/{process}/children') as file:
        return [int(child) for child in file.read().split()]


def is_alive(process):
    try:
        with open(f'/proc/{process}/stat') as stat:
            return stat.read().rsplit(') ', 1)[1][0] not in 'ZX'
    except (FileNotFoundError, ProcessLookupError):
        return False


class PageTest(unittest.IsolatedAsyncioTestCase):
    async def page(self, simulator, state='fast:-1'):
        socket = await connect(simulator)
        self.addAsyncCleanup(socket.close)
        await socket.send('w3d;broadcast')
        if state:
            await socket.send(state)
        return Page(socket)


class Programs(PageTest):
    def setUp(self):
        top = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, top)
        self.project = shutil.copytree(LESSONS, os.path.join(top, 'lessons'))

    def write(self, text, name='move'):
        with open(os.path.join(self.project, 'controllers', name, name + '.py'), 'w') as file:
            file.write(text)

    def world(self, name='lesson_1_move'):
        return os.path.join(self.project, 'worlds', name + '.wbt')

    def simulator(self, *options, world='lesson_1_move', **more):
        simulator = Simulator(*options, world=self.world(world), **more)
        self.addCleanup(simulator.end)
        return simulator.ready()

    async def run_program(self, text, expected):
        self.write(text)
        page = await self.page(self.simulator())
        return await page.line(expected), page

    async def test_each_lesson_can_be_solved(self):
        for world, (name, _) in SOLUTIONS.items():
            with self.subTest(world):
                self.write(solved(world), name)
                page = await self.page(self.simulator(world=world))
                self.assertRegex(await page.line('You did it'), r'^stdout:You did it: \d+\.\d s$')
                self.assertFalse([line for line in page.console if line.startswith('stderr:')])

    async def test_no_lesson_is_solved_before_it_has_begun(self):
        for world in SOLUTIONS:
            with self.subTest(world):
                page = await self.page(self.simulator(world=world), state='fast:30000')
                await page.frame('pause: 30')  # half a minute of simulated time
                self.assertFalse([line for line in page.console if 'You did it' in line])

    async def test_the_same_program_takes_the_same_time(self):
        self.write(solved('lesson_3_exit'), 'find_exit')
        simulator = self.simulator(world='lesson_3_exit')
        page = await self.page(simulator)
        first = await page.line('You did it')
        await page.socket.send('real-time:-1')
        await page.socket.send('fast:-1')
        await page.socket.send('reset')
        await page.frame('reset finished')
        self.assertEqual(await page.line('You did it'), first)

    async def test_reset_runs_what_the_file_has_then(self):
        self.write("print('first')\n")
        simulator = self.simulator()
        page = await self.page(simulator, state=None)  # paused
        await page.line('stdout:first')
        await page.line("INFO: 'move' controller exited successfully")
        self.write("print('second')\n")
        await page.socket.send('reset')
        await page.line('stdout:second')

    async def test_an_error_is_told_with_its_line(self):
        line, page = await self.run_program(START + "motor = robot.getDevice('left wheel motor')\nmotor.fly()\n",
                                            'AttributeError')
        self.assertEqual(line, "stderr:AttributeError: 'Motor' object has no attribute 'fly'")
        await page.line("WARNING: 'move' controller exited with status 1")
        told = [line for line in page.console if line.startswith('stderr:')]
        self.assertEqual(told[:2], ['stderr:Traceback (most recent call last):', 'stderr:  File "move.py", line 5, in <module>'])
        self.assertNotIn('stdin', ''.join(told))
        await page.frame('application/json:')  # the simulation goes on

    async def test_an_error_within_our_module_names_the_line_of_the_program(self):
        _, page = await self.run_program(START + "robot.getDevice('left wheel motor').setVelocity('fast')\n", 'ValueError')
        self.assertIn('stderr:  File "move.py", line 4, in <module>', page.console)
        self.assertNotIn('stdin', ''.join(page.console))

    async def test_what_is_no_python_is_told_with_its_line(self):
        _, page = await self.run_program(START + "if robot\n", 'SyntaxError')
        self.assertIn('stderr:  File "move.py", line 4', page.console)

    async def test_devices_measure_what_is_there(self):
        _, page = await self.run_program(START + """
names = ('ds3', 'gps', 'compass', 'left wheel sensor')
front, gps, compass, wheel = [robot.getDevice(name) for name in names]
print('before', front.getValue(), gps.getValues())
for device in (front, gps, compass, wheel):
    device.enable(step)
motors = [robot.getDevice(side + ' wheel motor') for side in ('left', 'right')]
for motor in motors:
    motor.setPosition(2)
    motor.setVelocity(1)
assert robot.getDevice('wings') is None
assert robot.step(step) == 0
print('first', robot.getName(), robot.getTime(), front.getValue(), gps.getValues(), compass.getValues())
for _ in range(100):
    robot.step()
print('then', round(robot.getTime(), 3), round(wheel.getValue(), 6), [round(x, 6) for x in gps.getValues()])
""", 'stdout:then')
        self.assertIn('stdout:before nan [nan, nan, nan]', page.console)
        self.assertIn('stdout:first robot 0.032 0.45 [-0.69888, 0.0, 0.0] [0.0, 1.0, 0.0]', page.console)
        self.assertIn('stdout:then 3.232 2.0 [-0.63, 0.0, 0.0]', page.console)
        self.assertTrue([line for line in page.console if line.startswith('stderr:Warning: the robot has no device "wings"')])

    async def test_a_program_that_never_steps_stops_neither_pictures_nor_pages(self):
        self.write("print('busy')\nwhile True:\n    pass\n")
        simulator = self.simulator('--stream=mjpeg')
        socket = await connect(simulator)
        self.addAsyncCleanup(socket.close)
        await socket.send('mjpeg: 320x200')
        await socket.send('real-time:-1')
        page = Page(socket)
        await page.line('stdout:busy')
        self.assertIn("'move' controller, which has not called robot.step()", await page.line('the simulation waits'))
        await socket.send('pause')
        await page.frame('paused by client')
        await socket.send('resize: 400x300')
        await page.frame('resize: 400 300')
        self.write("print('mended')\n")
        await socket.send('reset')
        await page.line('stdout:mended')

    async def test_a_program_that_prints_without_end_is_slowed_down(self):
        self.write("number = 0\nwhile True:\n    number += 1\n    print(number)\n")
        simulator = self.simulator()
        page = await self.page(simulator)
        await page.line('prints more than 100 lines in a second')
        numbers = [int(line.removeprefix('stdout:')) for line in page.console if line.startswith('stdout:') and line[7:].isdigit()]
        self.assertLessEqual(len(numbers), 100)  # the first second's
        self.assertEqual(numbers, list(range(numbers[0], numbers[0] + len(numbers))) if numbers else [])
        await page.socket.send('pause')
        await page.frame('paused by client')
        [program] = children(simulator.process.pid)
        wait_until(lambda: sleeps(program), 'the program waits until somebody reads')
        self.write("import sys\nsys.stdout.write('x' * 100000)\nsys.stdout.flush()\nprint('', file=sys.stderr)\n")
        await page.socket.send('reset')
        await page.line("'move' controller exited successfully")
        self.assertLessEqual(max(map(len, page.console)), 1000 + len('stdout:'))

    async def test_the_last_words_of_a_program_are_bounded(self):
        self.write("import os\nos.write(1, b'line\\n' * 10000)\n")
        page = await self.page(self.simulator())
        await page.line("'move' controller exited successfully")
        self.assertTrue(any('more lines are left out' in line for line in page.console) or
                        any('prints more than 100 lines' in line for line in page.console))

    async def test_a_program_that_breaks_the_rules_is_ended(self):
        for text in ("import os\nos.write(3, b'x' * 10000)\nwhile True: pass\n",
                     "import os\nos.write(3, b'fly away\\n')\nwhile True: pass\n",
                     "import os\nos.write(3, b'step 32 0 0 0 0\\n' * 1000)\nwhile True: pass\n"):
            with self.subTest(text):
                self.write(text)
                simulator = self.simulator()
                page = await self.page(simulator)
                await page.line("ERROR: 'move' controller: it sent")
                await page.line("'move' controller was ended by signal 9")
                self.assertEqual(children(simulator.process.pid), [])

    async def test_a_thousand_resets_leave_one_program(self):
        self.write(START + "print('here')\nwhile robot.step(step) != -1:\n    pass\n")
        simulator = self.simulator()
        page = await self.page(simulator)
        for _ in range(1000):
            await page.socket.send('reset')
        for _ in range(1000):
            await page.frame('reset finished')
        wait_until(lambda: len(children(simulator.process.pid)) == 1, lambda: children(simulator.process.pid))
        starts = sum('starting move.py' in line for line in page.console)
        self.assertLess(starts, 500)

    async def test_programs_do_not_outlive_the_simulator(self):
        self.write("while True:\n    pass\n")
        for signal_ in (signal.SIGKILL, signal.SIGTERM):
            with self.subTest(signal_):
                simulator = self.simulator()
                [program] = children(simulator.process.pid)
                simulator.process.send_signal(signal_)
                simulator.wait()
                wait_until(lambda: not is_alive(program), 'the program has ended')

    async def test_what_a_program_has_started_ends_with_it(self):
        self.write("import subprocess\nprint('child', subprocess.Popen(['sleep', '1000']).pid)\nwhile True: pass\n")
        simulator = self.simulator()
        page = await self.page(simulator)
        child = int((await page.line('stdout:child ')).split()[1])
        self.assertTrue(is_alive(child))
        await page.socket.send('reset')
        wait_until(lambda: not is_alive(child), 'the child has ended')

    async def test_programs_have_no_sockets_of_the_simulator(self):
        _, page = await self.run_program("import os\nprint('open', sorted(os.listdir('/proc/self/fd'), key=int))\n", 'stdout:open')
        self.assertIn("stdout:open ['0', '1', '2', '3', '4']", page.console)  # 4 is the folder that is listed

    async def test_without_python_the_robot_stands_and_the_console_says_why(self):
        simulator = self.simulator(environment={'PATH': '/nowhere'})
        page = await self.page(simulator)
        line = await page.line('python3')
        self.assertEqual(line, "stderr:ERROR: 'move' controller needs Python, and this machine has no python3 in its PATH: "
                               "install it, then reset the simulation. The robot stands.")
        await page.frame('application/json:{"time":320')  # time goes on


def sleeps(process):
    with open(f'/proc/{process}/stat') as stat:
        return stat.read().rsplit(') ', 1)[1][0] == 'S'


if __name__ == '__main__':
    simulator_process.main()
