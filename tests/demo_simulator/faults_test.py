#!/usr/bin/python3
"""Command line, exit and fault switches of the demo simulator, seen from the process that starts it."""

import os
import select
import signal
import socket
import subprocess
import tempfile
import unittest

import simulator_process
from simulator_process import ARENA, PATIENCE, Simulator, free_port, wait_until


def run(*arguments, faults=''):
    env = dict(os.environ, WEBOTS_DEMO_ADDRESS='127.0.0.1', WEBOTS_DEMO_FAULTS=faults)
    return subprocess.run([simulator_process.binary, *arguments], capture_output=True, env=env, timeout=PATIENCE)


def is_alive(pid):
    """True for a process that runs; zombies count as dead."""
    try:
        with open(f'/proc/{pid}/stat', 'rb') as stat:
            return stat.read().rpartition(b')')[2].split()[0] not in (b'Z', b'X')
    except FileNotFoundError:
        return False


def wait_for_death(pid):
    wait_until(lambda: not is_alive(pid), f'process {pid} still runs')


def is_full(pipe_of):
    """True when a process that writes to its standard output, a pipe, has to wait."""
    end = os.open(f'/proc/{pipe_of}/fd/1', os.O_WRONLY | os.O_NONBLOCK)
    try:
        return not select.select([], [end], [], 0)[1]
    finally:
        os.close(end)


def ask_as_controller(simulator):
    """What the simulator answers a controller that wants to join: PROCESSING while it loads its world."""
    with socket.create_connection(('127.0.0.1', simulator.port), timeout=PATIENCE) as peer:
        peer.sendall(b'CTR\nRobot-Name: blue\n\n')
        return peer.recv(100)


class CommandLine(unittest.TestCase):
    def test_version_and_help_say_that_it_is_not_webots(self):
        for option in ('--version', '--help', '--sysinfo'):
            result = run(option)
            self.assertEqual(result.returncode, 0, option)
            self.assertIn(b'not Webots', result.stdout, option)
        self.assertIn(b'daemon-grandchild', run('--help').stdout)

    def test_invalid_options_print_two_lines_and_fail(self):
        for arguments in (['--port=0'], ['--port=65536'], ['--port=x'], ['--stream=webgl'], ['--nonsense'], ['--mode=warp'],
                          ['--heartbeat=0'], ['--demo-faults=explode'], ['convert', 'x.proto'], []):
            world = [] if arguments[:1] in (['convert'], []) else [ARENA]
            result = run(*arguments, *world)
            lines = result.stderr.decode().splitlines()
            self.assertEqual(result.returncode, 1, arguments)
            self.assertEqual(len(lines), 2, (arguments, lines))
            self.assertTrue(lines[0].startswith('webots: '), lines)
            self.assertEqual(lines[1], "Try 'webots --help' for more information.")

    def test_a_missing_world_is_named_on_stderr(self):
        result = run('/nowhere/worlds/missing.wbt')
        self.assertEqual(result.returncode, 1)
        self.assertIn(b'/nowhere/worlds/missing.wbt', result.stderr)
        self.assertNotIn(b'\n.\n', result.stdout)

    def test_says_at_start_that_it_is_not_webots(self):
        with Simulator() as simulator:
            self.assertIn(b'not Webots', simulator.line())

    def test_accepts_the_command_line_of_a_simulation_server(self):
        with Simulator('--minimize', '--no-rendering', '--heartbeat=5000', '--stream') as simulator:
            simulator.ready()

    def test_accepts_the_command_line_of_old_simulation_servers(self):
        port = free_port()
        with Simulator('--no-sandbox', '--stdout', '--stderr',
                       f'--stream="port={port};monitorActivity;mode=mjpeg;ssl"') as simulator:
            simulator.lines_until(b'open')
            socket.create_connection(('127.0.0.1', simulator.port), timeout=PATIENCE).close()

    def test_a_busy_port_gives_way_to_the_next_free_one(self):
        with socket.socket() as other:
            other.bind(('127.0.0.1', 0))
            other.listen()
            taken = other.getsockname()[1]
            with Simulator(f'--port={taken}') as simulator:
                self.assertGreater(simulator.port, taken)
                self.assertLessEqual(simulator.port, taken + 10)

    def test_worlds_of_any_bytes_are_survived(self):
        worlds = {
            'empty.wbt': b'',
            'binary.wbt': bytes(range(256)) * 64,
            'open.wbt': b'#VRML_SIM R2025a utf8\nWorldInfo { title "',
            'deep.wbt': b'#VRML_SIM R2025a utf8\n' + b'Group { children [ ' * 5000,
            'latin1.wbt': b'#VRML_SIM R2025a utf8\nWorldInfo { title "caf\xe9" }\nXRobot { name "\xff" }',
        }
        with tempfile.TemporaryDirectory() as folder:
            for name, content in worlds.items():
                path = os.path.join(folder, name)
                with open(path, 'wb') as file:
                    file.write(content)
                with Simulator(world=path) as simulator:
                    simulator.ready()


class Faults(unittest.TestCase):
    def test_heartbeats_repeat(self):
        with Simulator('--heartbeat=20') as simulator:
            for _ in range(5):
                simulator.lines_until(b'.')

    def test_sigterm_ends_it(self):
        with Simulator() as simulator:
            simulator.ready()
            simulator.process.terminate()
            self.assertEqual(simulator.wait(), -signal.SIGTERM)

    def test_never_ready_listens_and_stays_silent(self):
        with Simulator('--heartbeat=10') as beside, Simulator('--heartbeat=10', faults='never-ready') as simulator:
            self.assertEqual(ask_as_controller(simulator), b'PROCESSING')
            for _ in range(30):  # of one that is ready
                beside.lines_until(b'.')
            self.assertEqual(ask_as_controller(simulator), b'PROCESSING')
            self.assertFalse(simulator.has_line_now())
            self.assertIsNone(simulator.process.poll())

    def test_ready_delay_delays_ready(self):
        with Simulator(faults='ready-delay=3600000') as simulator:
            self.assertEqual(ask_as_controller(simulator), b'PROCESSING')
            self.assertFalse(simulator.has_line_now())
        with Simulator(faults='ready-delay=50') as simulator:
            simulator.ready()
            self.assertEqual(ask_as_controller(simulator), b'FAILED')

    def test_exit_before_ready(self):
        for faults, status in (('exit-before-ready', 1), ('exit-before-ready=7', 7), ('exit-before-ready=0', 0)):
            with Simulator(faults=faults) as simulator:
                self.assertEqual(simulator.wait(), status)
                with self.assertRaises(AssertionError):
                    simulator.ready()

    def test_exit_after_ready(self):
        with Simulator(faults='exit-after-ready=50') as simulator:
            simulator.ready()
            self.assertEqual(simulator.wait(), 0)

    def test_crash_before_ready(self):
        for faults in ('crash', 'crash-before-ready'):
            with Simulator(faults=faults) as simulator:
                self.assertEqual(simulator.wait(), -signal.SIGSEGV)
                with self.assertRaises(AssertionError):
                    simulator.ready()

    def test_crash_after_ready(self):
        with Simulator(faults='crash-after-ready=50') as simulator:
            simulator.ready()
            self.assertEqual(simulator.wait(), -signal.SIGSEGV)

    def test_hang_stops_heartbeats_and_answers_and_still_ends_by_sigterm(self):
        with Simulator('--heartbeat=10') as beside, Simulator('--heartbeat=10', faults='hang') as simulator:
            simulator.ready()
            with socket.create_connection(('127.0.0.1', simulator.port), timeout=PATIENCE) as peer:
                peer.sendall(b'GET /index.html HTTP/1.1\r\nHost: x\r\n\r\n')
                for _ in range(30):  # of one that does not hang
                    beside.lines_until(b'.')
                peer.setblocking(False)
                with self.assertRaises(BlockingIOError):
                    peer.recv(1)
            self.assertFalse(simulator.has_line_now())
            simulator.process.terminate()
            self.assertEqual(simulator.wait(), -signal.SIGTERM)

    def test_ignore_sigterm(self):
        with Simulator('--heartbeat=50', faults='ignore-sigterm') as simulator:
            simulator.ready()
            simulator.process.terminate()
            for _ in range(4):
                simulator.lines_until(b'.')
            self.assertIsNone(simulator.process.poll())

    def grandchild(self, simulator, marker):
        while True:
            line = simulator.line()
            self.assertIsNotNone(line)
            if line.startswith(b'demo simulator: ' + marker):
                return int(line.split()[-1])

    def test_grandchild_stays_in_the_process_group_and_outlives_its_parent(self):
        with Simulator(faults='grandchild') as simulator:
            pid = self.grandchild(simulator, b'grandchild')
            try:
                simulator.ready()
                self.assertEqual(os.getpgid(pid), os.getpgid(simulator.process.pid))
                simulator.process.terminate()
                simulator.wait()
                self.assertTrue(is_alive(pid))
            finally:
                os.kill(pid, signal.SIGTERM)
            wait_for_death(pid)

    def test_daemon_grandchild_leaves_the_session_and_survives_sigterm(self):
        with Simulator(faults='daemon-grandchild') as simulator:
            pid = self.grandchild(simulator, b'daemon grandchild')
            try:
                simulator.ready()
                wait_until(lambda: os.getsid(pid) != os.getsid(simulator.process.pid), 'it stays in the session')
                wait_until(lambda: self.ignores_sigterm(pid), 'it does not ignore SIGTERM')
                os.kill(pid, signal.SIGTERM)  # which the kernel drops at once where it is ignored
                self.assertTrue(is_alive(pid))
                self.assertTrue(self.ignores_sigterm(pid))
            finally:
                os.kill(pid, signal.SIGKILL)
            wait_for_death(pid)

    @staticmethod
    def ignores_sigterm(pid):
        with open(f'/proc/{pid}/status') as status:
            ignored = next(line for line in status if line.startswith('SigIgn'))
        return bool(int(ignored.split()[1], 16) >> (signal.SIGTERM - 1) & 1)

    def test_flood_goes_on_beside_ready_and_heartbeats(self):
        with Simulator('--heartbeat=50', faults='flood') as simulator:
            self.assertGreater(len(simulator.lines_until(b'.')), 100)
            self.assertGreater(len(simulator.lines_until(b'.')), 100)

    def test_flood_that_nobody_reads_still_ends_by_sigterm(self):
        env = dict(os.environ, WEBOTS_DEMO_ADDRESS='127.0.0.1', WEBOTS_DEMO_FAULTS='flood')
        with subprocess.Popen([simulator_process.binary, f'--port={free_port()}', ARENA], stdout=subprocess.PIPE,
                              env=env) as process:
            process.stdout.read(1 << 17)
            wait_until(lambda: is_full(process.pid), 'it does not fill the pipe')
            process.terminate()
            self.assertEqual(process.wait(PATIENCE), -signal.SIGTERM)

    def test_wrong_port_listens_elsewhere(self):
        port = free_port()
        with Simulator(f'--port={port}', faults='wrong-port') as simulator:
            simulator.ready()
            self.assertNotEqual(simulator.port, port)

    def test_long_lines(self):
        with Simulator(faults='long-lines') as simulator:
            self.assertGreater(max(map(len, simulator.lines_until(b'.'))), 1 << 20)

    def test_binary_lines_are_not_utf8(self):
        with Simulator(faults='binary-lines') as simulator:
            with self.assertRaises(UnicodeDecodeError):
                b''.join(simulator.lines_until(b'.')).decode()

    def test_no_final_newline(self):
        with Simulator(faults='no-final-newline,exit-after-ready=0') as simulator:
            simulator.ready()
            self.assertEqual(simulator.wait(), 0)
            last = [line for line in iter(simulator.line, None)][-1]
            self.assertFalse(last.endswith(b'\n'))

    def test_stream_modes_of_other_releases_can_be_refused(self):
        self.assertEqual(run('--stream=w3d', ARENA, faults='refuse-w3d').returncode, 1)
        self.assertEqual(run('--stream=x3d', ARENA, faults='refuse-x3d').returncode, 1)
        with Simulator('--stream=w3d', faults='refuse-x3d') as simulator:
            simulator.ready()

    def test_faults_of_the_command_line_add_to_those_of_the_environment(self):
        with Simulator('--demo-faults=no-final-newline', faults='exit-before-ready=3') as simulator:
            self.assertEqual(simulator.wait(), 3)
            self.assertFalse([line for line in iter(simulator.line, None)][-1].endswith(b'\n'))


if __name__ == '__main__':
    simulator_process.main()
