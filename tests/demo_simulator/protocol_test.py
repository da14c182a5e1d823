#!/usr/bin/python3
"""The streaming protocol of the demo simulator, seen from a browser."""

import asyncio
import contextlib
import http.client
import json
import os
import re
import shutil
import signal
import socket
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

import simulator_process
from simulator_process import PATIENCE, PROJECTS, Simulator, free_port, wait_until, wait_until_async

try:
    import websockets
except ImportError:
    print('skipped: the websockets package is missing (Debian: python3-websockets)')
    raise SystemExit(77)


class Browser:
    """One WebSocket; keeps what it has received."""

    def __init__(self, socket_):
        self.socket = socket_
        self.received = []

    async def send(self, text):
        await self.socket.send(text)

    async def receive(self):
        text = await asyncio.wait_for(self.socket.recv(), PATIENCE)
        self.received.append(text)
        return text

    async def until(self, prefix):
        """The first frame that starts with `prefix`, other frames before it are passed over."""
        while True:
            text = await self.receive()
            if text.startswith(prefix):
                return text

    async def reply(self, prefixes=('application/json:', 'time: ', 'stdout:')):
        """The next frame that is none of the frequent ones."""
        while True:
            text = await self.receive()
            if not text.startswith(prefixes):
                return text


def has_read_all(peer):
    """True when the other end of this connection, of the same machine, has read what was sent."""
    ports = {peer.getsockname()[1], peer.getpeername()[1]}
    with open('/proc/net/tcp') as table:
        rows = [line.split() for line in table.readlines()[1:]]
    queues = [row[4] for row in rows if {int(row[1].split(':')[1], 16), int(row[2].split(':')[1], 16)} == ports]
    return queues == ['00000000:00000000'] * 2


def connect(simulator):
    return websockets.connect(f'ws://127.0.0.1:{simulator.port}/', max_size=None, max_queue=None, ping_interval=None)


WITH_EXTERN = """#VRML_SIM R2025a utf8
E-puck { name "participant" controller "<extern>" }
E-puck { name "../x" controller "<extern>" }
"""


class Pictures:
    """`GET /mjpeg`: the parts of the answer, one by one."""

    def __init__(self, simulator, receive_buffer=None):
        self.socket = socket.socket()
        self.socket.settimeout(PATIENCE)
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect(('127.0.0.1', simulator.port))
        self.socket.sendall(b'GET /mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n')
        self.file = self.socket.makefile('rb')
        self.head = self._head()

    def _head(self):
        lines = []
        while (line := self.file.readline()) not in (b'\r\n', b''):
            lines.append(line.rstrip(b'\r\n').decode())
        return lines

    def next(self):
        head = self._head()
        assert head[0] == '--WebotsFrame', head
        assert head[1] == 'Content-Type: image/jpeg', head
        size = int(head[2].removeprefix('Content-Length: '))
        jpeg = self.file.read(size)
        assert self.file.read(2) == b'\r\n'
        return jpeg

    async def next_soon(self):
        return await asyncio.get_running_loop().run_in_executor(None, self.next)

    def is_silent(self):
        """True when no byte has come since the last picture; use it last."""
        self.socket.setblocking(False)
        return self.file.read(1) is None

    def close(self):
        self.file.close()
        self.socket.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def state_of(frame):
    return json.loads(frame.removeprefix('application/json:'))


class Case(unittest.IsolatedAsyncioTestCase):
    def simulator(self, *options, **more):
        simulator = Simulator(*options, **more)
        self.addCleanup(simulator.end)
        return simulator.ready()

    @contextlib.asynccontextmanager
    async def joined(self, simulator, *more):
        """A browser that has been told what it is told at first."""
        async with connect(simulator) as ws:
            browser = Browser(ws)
            await self.join(browser, *more)
            yield browser


class Scene(Case):
    async def join(self, browser, mode='w3d'):
        await browser.send(mode)
        world = await browser.receive()
        model = await browser.receive()
        state = await browser.receive()
        rest = [await browser.receive(), await browser.receive()]
        return world, model, state, rest

    async def test_the_answer_to_the_mode_line(self):
        for option, mode in (('--stream', 'x3d'), ('--stream=w3d', 'w3d'), ('--stream=x3d', 'x3d;broadcast')):
            simulator = self.simulator(option)
            async with connect(simulator) as ws:
                world, model, state, rest = await self.join(Browser(ws), mode)
            self.assertEqual(world, 'world:worlds/arena.wbt:worlds/arena.wbt;worlds/corridor.wbt;worlds/duel.wbt')
            self.assertTrue(model.startswith('model:<?xml'))
            self.assertEqual(state_of(state)['time'], 0)
            self.assertEqual(rest, ['scene load completed', 'pause: 0'])

    async def test_the_model_has_what_the_world_has(self):
        simulator = self.simulator('--stream=w3d')
        async with connect(simulator) as ws:
            _, model, state, _ = await self.join(Browser(ws))
        root = ElementTree.fromstring(model.removeprefix('model:'))
        scene = root.find('Scene')
        self.assertEqual(root.find("head/meta[@name='version']").get('content'), 'R2025a')
        self.assertEqual(scene.find('WorldInfo').get('title'), 'Robots in an arena')
        self.assertIsNotNone(scene.find('Viewpoint').get('position'))
        robots = {robot.get('name'): robot for robot in scene.findall('Robot')}
        self.assertEqual(set(robots), {'blue', 'red', 'green', 'yellow'})
        self.assertEqual(robots['blue'].get('translation'), '-0.8 -0.5 0')
        tiles = scene.find('Shape/IndexedFaceSet')  # those of the arena's floor, of 2.4 x 1.8 m, that are dark
        self.assertEqual(len(tiles.find('Coordinate').get('point').split()) // 12, tiles.get('coordIndex').split().count('-1'))
        self.assertEqual(tiles.get('coordIndex').split().count('-1'), 60)
        ids = [node.get('id') for node in scene.iter() if node is not scene]
        self.assertEqual(len(ids), len(set(ids)), 'ids are unique')
        for name in ids:
            self.assertRegex(name, r'^n\d+$')
        for update in state_of(state)['updates']:
            self.assertIn(f'n{update["id"]}', ids)
            self.assertEqual(len(update['rotation'].split()), 4)

    async def test_running_moves_the_robots_and_time(self):
        simulator = self.simulator()
        async with connect(simulator) as ws:
            browser = Browser(ws)
            _, _, first, _ = await self.join(browser)
            await browser.send('real-time:-1')
            self.assertEqual(await browser.reply(), 'real-time')
            states = [state_of(await browser.until('application/json:')) for _ in range(10)]
        times = [state['time'] for state in states]
        self.assertEqual(times, sorted(set(times)))
        for time_ in times:
            self.assertEqual(time_ % 32, 0)
        self.assertNotEqual(states[-1]['updates'], state_of(first)['updates'])
        simulator.lines_until(b'real-time')

    async def test_state_frames_are_no_more_frequent_than_the_world_wants(self):
        with tempfile.TemporaryDirectory() as folder:
            world = os.path.join(folder, 'quick.wbt')
            with open(world, 'w', encoding='utf-8') as file:
                file.write('#VRML_SIM R2025a utf8\nWorldInfo { basicTimeStep 1 FPS 20 }\n')
            simulator = self.simulator(world=world)
            async with connect(simulator) as ws:
                browser = Browser(ws)
                await browser.send('w3d')
                await browser.until('pause: 0')
                await browser.send('real-time:-1')
                times = [state_of(await browser.until('application/json:'))['time'] for _ in range(8)]
        for earlier, later in zip(times, times[1:]):
            self.assertGreaterEqual(later - earlier, 50, 'a twentieth of a second, simulated in real time')

    async def test_the_same_steps_give_the_same_poses(self):
        async def after_steps():
            simulator = self.simulator()
            async with self.joined(simulator) as browser:
                for _ in range(50):
                    await browser.send('step')
                    self.assertEqual(await browser.reply(), 'paused by client')
                states = [text for text in browser.received if text.startswith('application/json:')]
                return state_of(states[-1])
        first = await after_steps()
        self.assertEqual(first['time'], 50 * 32)
        self.assertEqual(first, await after_steps())

    async def test_pause(self):
        simulator = self.simulator('--mode=realtime', '--heartbeat=30')
        async with connect(simulator) as ws:
            browser = Browser(ws)

            async def step():
                await browser.send('step')
                self.assertEqual(await browser.reply(), 'paused by client')
                return state_of([text for text in browser.received if text.startswith('application/json:')][-1])['time']

            await browser.send('x3d;broadcast')
            await browser.until('scene load completed')
            await browser.until('application/json:')
            await browser.send('pause')
            self.assertEqual(await browser.until('paused'), 'paused by client')
            simulator.lines_until(b'pause')
            before = await step()
            for _ in range(10):  # as long as it simulates ten steps, if it does
                await asyncio.to_thread(simulator.lines_until, b'.')
            self.assertEqual(await step(), before + 32)

    async def test_a_client_that_does_not_broadcast_pauses_a_running_simulation(self):
        simulator = self.simulator('--mode=realtime')
        async with connect(simulator) as ws:
            browser = Browser(ws)
            await browser.send('x3d')
            await browser.until('scene load completed')
            self.assertRegex(await browser.until('pause'), r'^pause: \d+$')
        simulator.lines_until(b'pause')

    async def test_the_deadline_is_in_simulated_time(self):
        for mode in ('real-time', 'fast'):
            simulator = self.simulator()
            async with self.joined(simulator) as browser, self.joined(simulator) as other:
                await browser.send(f'{mode}:320')
                self.assertEqual(await browser.reply(), mode)
                self.assertEqual(await browser.reply(), 'pause: 320')
                self.assertEqual(await other.reply(), 'pause: 320', 'the other client is told of the deadline only')
            simulator.lines_until(mode.encode())
            simulator.lines_until(b'pause')
            simulator.lines_until(b'pause')

    async def test_timeout_moves_the_deadline(self):
        simulator = self.simulator()
        async with self.joined(simulator) as browser:
            await browser.send('fast:10000000')
            self.assertEqual(await browser.reply(), 'fast')
            await browser.send('timeout:0')
            stopped = await browser.reply()
            self.assertRegex(stopped, r'^pause: \d+$')
            self.assertLess(int(stopped.split()[1]), 10000000)

    async def test_step(self):
        simulator = self.simulator()
        async with self.joined(simulator) as browser:
            await browser.send('step')
            self.assertEqual(await browser.reply(), 'paused by client')
            self.assertEqual(state_of(browser.received[-2])['time'], 32)
        simulator.lines_until(b'step')
        self.assertEqual(simulator.line(), b'pause\n')

    async def test_reset_tells_everyone(self):
        simulator = self.simulator()
        async with connect(simulator) as first, connect(simulator) as second:
            browser, other = Browser(first), Browser(second)
            _, _, start, _ = await self.join(browser)
            await self.join(other)
            await browser.send('step')
            await browser.reply()
            await browser.send('reset')
            for each in (browser, other):
                self.assertEqual(await each.reply(), 'reset finished')
                self.assertEqual(each.received[-2], start)
        simulator.lines_until(b'reset')

    async def test_reload_and_load_send_the_world_again_to_everyone(self):
        for command, world in (('reload', 'arena'), ('revert', 'arena'), ('load:duel.wbt', 'duel'),
                               ('load:elsewhere/duel.wbt', 'duel')):
            simulator = self.simulator()
            async with connect(simulator) as first, connect(simulator) as second:
                browsers = [Browser(first), Browser(second)]
                for browser in browsers:
                    await self.join(browser)
                await browsers[0].send(command)
                for browser in browsers:
                    self.assertEqual(await browser.receive(), 'delete world')
                    self.assertRegex(await browser.receive(), r'^loading:[A-Z][a-z ]+:\d+$')
                    self.assertTrue((await browser.until('world:')).startswith(f'world:worlds/{world}.wbt:'))
                    self.assertTrue((await browser.receive()).startswith('model:<?xml'))
                    self.assertTrue((await browser.receive()).startswith('application/json:'))
                    self.assertEqual(await browser.receive(), 'scene load completed')
                    self.assertEqual(await browser.receive(), 'pause: 0')

    async def test_an_unknown_world_is_only_logged(self):
        simulator = self.simulator()
        async with self.joined(simulator) as browser:
            for name in ('load:missing.wbt', 'load:', 'load:..', 'load:../webots.yml'):
                await browser.send(name)
            await browser.send('pause')
            self.assertEqual(await browser.receive(), 'paused by client')
        self.assertEqual(sum(b'Unknown world' in line for line in simulator.lines_until(b'pause')), 4)

    async def test_state_changes_are_not_told_to_other_clients(self):
        simulator = self.simulator()
        async with self.joined(simulator) as browser, self.joined(simulator) as other:
            await browser.send('real-time:-1')
            await browser.until('real-time')
            await browser.send('pause')
            await browser.until('paused by client')
            await other.send('pause')
            await other.until('paused by client')
            told = [text for text in other.received[5:-1] if not text.startswith(('application/json:', 'stdout:'))]
            self.assertEqual(told, [])

    async def test_console_lines_that_nobody_has_heard_reach_the_first_who_joins(self):
        simulator = self.simulator('--stdout')
        async with self.joined(simulator) as browser:
            await browser.send('fast:60000')
            line = await browser.until('stdout:')
            self.assertRegex(line, r'^stdout:robot (blue|red|green|yellow): [a-z ]+ ahead$')
            await browser.until('pause: ')
            await browser.send('fast:60000')
            await browser.until('fast')
        simulator.lines_until(line.removeprefix('stdout:').encode())
        simulator.lines_until(b'pause')
        simulator.lines_until(b'pause')
        async with self.joined(simulator) as first:
            self.assertRegex(await first.receive(), r'^stdout:robot ')
            async with self.joined(simulator) as second:
                await second.send('pause')
                while (text := await second.receive()) != 'paused by client':
                    self.assertFalse(text.startswith('stdout:'), text)

    async def test_what_an_extern_controller_prints_is_in_the_console(self):
        user = f'demo_{os.getpid()}'
        self.addCleanup(shutil.rmtree, f'/tmp/webots/{user}', ignore_errors=True)
        with tempfile.NamedTemporaryFile('w', suffix='.wbt') as world:
            world.write(WITH_EXTERN)
            world.flush()
            simulator = self.simulator('--stream', world=world.name, environment={'USER': user})
        robots = f'/tmp/webots/{user}/{simulator.port}/ipc'
        self.assertEqual(os.listdir(robots), ['participant'])
        async with self.joined(simulator) as browser:
            for said in ('first', 'second'):  # the next one, when the first has left
                with socket.socket(socket.AF_UNIX) as controller:
                    controller.connect(f'{robots}/participant/extern')
                    controller.sendall(f'{said} \xff\n'.encode('latin-1') + 10000 * b'x')
                    self.assertEqual(await browser.until(f'stdout:{said}'), f'stdout:{said} ?')

    async def test_messages_for_robots(self):
        simulator = self.simulator()
        async with self.joined(simulator) as browser:
            for text in ('robot:blue:hello', 'robot:{"name":"blue","message":"hello"}'):
                await browser.send(text)
                self.assertEqual(await browser.receive(), 'robot: {"message":"received hello","name":"blue"}')

    async def test_an_edited_controller_counts_after_the_next_reset(self):
        project = tempfile.TemporaryDirectory()
        self.addCleanup(project.cleanup)
        shutil.copytree(os.path.join(PROJECTS, 'robots'), project.name, dirs_exist_ok=True)
        world = os.path.join(project.name, 'worlds', 'arena.wbt')
        simulator = Simulator(f'--stream="port={free_port()};monitorActivity;controllerEdit"', world=world)
        self.addCleanup(simulator.end)
        simulator.lines_until(b'open')

        async def state(browser):
            await browser.send('step')
            return state_of(await browser.until('application/json:'))['updates']

        async with self.joined(simulator) as browser:
            await browser.send('get controller:avoid_walls')
            head, _, text = (await browser.until('set controller:')).partition('\n')
            self.assertEqual(head, f'set controller:avoid_walls/avoid_walls.py:{len(text.splitlines())}')
            first = await state(browser)
            self.assertNotEqual(await state(browser), first)
            stopped = text.replace('CRUISE = 8.0', 'CRUISE = 0')
            await browser.send(f'set controller:avoid_walls/avoid_walls.py:{len(stopped.splitlines())}\n{stopped}')
            self.assertIn('it counts after the next reset', await browser.until('stdout:demo simulator: avoid_walls/avoid_walls.py'))
            second = await state(browser)
            self.assertNotEqual(await state(browser), second)
            await browser.send('reset')
            await browser.until('reset finished')
            still = await state(browser)
            self.assertEqual(await state(browser), still)
            await browser.send('sync controller:avoid_walls/avoid_walls.py')
            self.assertTrue((await browser.until('set controller:')).endswith(stopped))
            with open(os.path.join(project.name, 'controllers', 'avoid_walls', 'avoid_walls.py')) as file:
                self.assertEqual(file.read(), stopped)

    async def test_nobody_edits_without_leave(self):
        simulator = self.simulator()
        async with self.joined(simulator) as browser:
            for text in ('get controller:avoid_walls', 'set controller:avoid_walls/avoid_walls.py:1\nCRUISE = 0'):
                await browser.send(text)
            await browser.send('step')
            self.assertEqual(await browser.reply(), 'paused by client')
        lines = simulator.lines_until(b'step')
        self.assertEqual(sum(b'--stream has no controllerEdit' in line for line in lines), 2)

    async def test_garbage_is_logged_and_survived(self):
        simulator = self.simulator()
        async with connect(simulator) as ws:
            browser = Browser(ws)
            await browser.send('pause before any mode line')
            await self.join(browser)
            for garbage in ('', 'x' * 100000, 'real-time:', 'real-time:1e9', 'fast:99999999999999999999', 'timeout:x',
                            'resize: 0x0', 'mouse', 'mouse nan', 'robot:', 'robot:{', 'robot:{"name":1,"message":2}',
                            'robot:nobody:hi', 'load', '\x00\x01', '💥', 'mjpeg: 9x9', 'real-time:\n5', 'set controller:x/y:1\nz'):
                await browser.send(garbage)
            await browser.send(b'\xff\xfe binary')
            await browser.send('step')
            self.assertEqual(await browser.reply(), 'paused by client')
        lines = simulator.lines_until(b'step')
        self.assertGreater(sum(b'Unsupported message' in line for line in lines), 8)
        for line in lines:
            line.decode()
            self.assertLess(len(line), 300)

    async def test_the_mode_line_of_the_other_kind_gets_no_answer(self):
        for option, wrong, right in (('--stream=w3d', 'mjpeg: 64x48', 'w3d'), ('--stream=mjpeg', 'w3d', 'mjpeg: 64x48')):
            async with connect(self.simulator(option)) as ws, connect(self.simulator(option)) as other:
                await ws.send(wrong)
                await ws.send(right)
                await other.send(right)
                self.assertEqual(await Browser(ws).receive(), await Browser(other).receive())

    async def test_a_client_that_comes_while_the_world_loads_gets_it_later(self):
        simulator = Simulator(faults='ready-delay=500')
        self.addCleanup(simulator.end)
        async with connect(simulator) as ws:
            browser = Browser(ws)
            await browser.send('w3d')
            self.assertRegex(await browser.receive(), r'^loading:Parsing nodes:\d+$')
            await browser.until('world:')
            await browser.until('scene load completed')

    async def test_releases_before_r2023a_call_the_updates_poses(self):
        with tempfile.TemporaryDirectory() as folder:
            os.mkdir(os.path.join(folder, 'worlds'))
            world = os.path.join(folder, 'worlds', 'old.wbt')
            with open(world, 'w', encoding='utf-8') as file:
                file.write('#VRML_SIM R2022b utf8\nWorldInfo { title "a <b> & \\"c\\"" }\n')
            simulator = self.simulator(world=world)
            async with connect(simulator) as ws:
                _, model, state, _ = await self.join(Browser(ws), 'x3d')
        self.assertIn('poses', state_of(state))
        scene = ElementTree.fromstring(model.removeprefix('model:')).find('Scene')
        self.assertEqual(scene.find('WorldInfo').get('title'), 'a <b> & "c"')
        self.assertEqual(len([node for node in scene.findall('Transform') if node.get('name') in ('blue', 'red', 'green')]), 3)

    async def test_many_clients_and_a_bound(self):
        simulator = self.simulator()
        sockets = []
        try:
            for _ in range(64):
                ws = await connect(simulator)
                sockets.append(ws)
                await self.join(Browser(ws))
            with self.assertRaises((ConnectionError, websockets.exceptions.InvalidMessage, EOFError)):
                async with connect(simulator) as one_too_many:
                    await one_too_many.recv()
            await sockets[0].send('step')
            for ws in sockets:
                await Browser(ws).until('application/json:')
        finally:
            await asyncio.gather(*(ws.close() for ws in sockets))

        async def join_again():
            try:
                async with connect(simulator) as ws:
                    await self.join(Browser(ws))
                return True
            except (ConnectionError, websockets.exceptions.InvalidMessage, EOFError):
                return False
        # the places are free again once the server has seen the closes
        await wait_until_async(join_again, 'no place became free')


class Mjpeg(Case):
    async def join(self, browser, size='320x240'):
        await browser.send(f'mjpeg: {size}')
        await browser.until('scene load completed')
        return browser.received

    async def test_the_answer_to_the_mode_line(self):
        simulator = self.simulator('--stream=mjpeg')
        async with connect(simulator) as first, connect(simulator) as second:
            own = await self.join(Browser(first))
            self.assertEqual(own, ['multimedia: mjpeg pause ', 'pause: 0',
                                   'world info: {"title":"Robots in an arena","window":"<none>"}',
                                   'world:worlds/arena.wbt:worlds/arena.wbt;worlds/corridor.wbt;worlds/duel.wbt', 'scene load completed'])
            other = await self.join(Browser(second), '900x900')
            self.assertEqual(other[0], 'multimedia: mjpeg pause 320 240')

    async def test_pictures_differ_while_it_runs_and_times_advance(self):
        simulator = self.simulator('--stream=mjpeg')
        async with self.joined(simulator) as browser:
            with Pictures(simulator) as pictures:
                await browser.send('real-time:-1')
                jpegs = [await pictures.next_soon() for _ in range(12)]
                times = [int((await browser.until('time: ')).split()[1]) for _ in range(6)]
        self.assertEqual(times, sorted(times))
        self.assertGreater(times[-1], times[0])
        self.assertGreater(len(set(jpegs)), 6)
        for jpeg in jpegs:
            self.assertTrue(jpeg.startswith(b'\xff\xd8\xff') and jpeg.endswith(b'\xff\xd9'))

    async def test_while_paused_each_picture_comes_twice_and_nothing_follows(self):
        simulator = self.simulator('--stream=mjpeg', '--heartbeat=30')
        async with self.joined(simulator) as browser:
            with Pictures(simulator) as pictures:
                first = await pictures.next_soon()
                self.assertEqual(await pictures.next_soon(), first)
                await browser.send('step')
                stepped = await pictures.next_soon()
                self.assertNotEqual(stepped, first)
                self.assertEqual(await pictures.next_soon(), stepped)
                simulator.lines_until(b'step')
                for _ in range(10):  # as long as it makes ten pictures, if it does
                    await asyncio.to_thread(simulator.lines_until, b'.')
                self.assertTrue(pictures.is_silent())

    async def test_the_head_of_the_picture_stream(self):
        simulator = self.simulator('--stream=mjpeg')
        async with self.joined(simulator):
            with Pictures(simulator) as pictures:
                self.assertEqual(pictures.head[0], 'HTTP/1.0 200 OK')
                self.assertIn('Content-Type: multipart/x-mixed-replace; boundary=WebotsFrame', pictures.head)
                self.assertIn('Connection: close', pictures.head)
                self.assertIn('Cache-Control: no-cache, private', pictures.head)

    async def test_as_webots_it_ends_where_pictures_are_fetched_before_anybody_has_asked_for_them(self):
        simulator = self.simulator('--stream=mjpeg')
        async with connect(simulator) as ws:
            await ws.send('pause')  # which says no size
            self.assertEqual(await asyncio.wait_for(ws.recv(), PATIENCE), 'paused by client')
            with socket.create_connection(('127.0.0.1', simulator.port), PATIENCE) as early:
                early.sendall(b'GET /mjpeg HTTP/1.1\r\nHost: localhost\r\n\r\n')
                self.assertEqual(await asyncio.to_thread(simulator.wait), -signal.SIGSEGV)
        self.assertIn(b'GET /mjpeg came before any WebSocket has said "mjpeg: <width>x<height>"', simulator.process.stderr.read())

    async def test_pictures_may_be_fetched_once_any_client_has_asked_for_them(self):
        simulator = self.simulator('--stream=mjpeg')
        async with connect(simulator), self.joined(simulator, '320x240'):
            pass
        with Pictures(simulator) as pictures:
            self.assertEqual(self.size_of(await pictures.next_soon()), (320, 240))

    @staticmethod
    def size_of(jpeg):
        at = 2
        while jpeg[at + 1] not in (0xc0, 0xc2):
            at += 2 + int.from_bytes(jpeg[at + 2:at + 4], 'big')
        return int.from_bytes(jpeg[at + 7:at + 9], 'big'), int.from_bytes(jpeg[at + 5:at + 7], 'big')

    async def test_resize_and_its_limits(self):
        simulator = self.simulator('--stream=mjpeg')
        async with self.joined(simulator) as browser, self.joined(simulator) as other:
            for asked, given in (('200x100', (200, 100)), ('1x1', (32, 32)), ('99999x99999', (1920, 1200)), ('641x479', (641, 479))):
                await browser.send(f'resize: {asked}')
                answer = f'resize: {given[0]} {given[1]}'
                self.assertEqual(await browser.reply(), answer)
                self.assertEqual(await other.reply(), answer)
                with Pictures(simulator) as pictures:
                    self.assertEqual(self.size_of(await pictures.next_soon()), given)
            await other.send('resize: 100x100')
            await other.send('pause')
            self.assertEqual(await other.reply(), 'paused by client', 'only the first client may resize')

    async def test_the_mouse_turns_the_view(self):
        simulator = self.simulator('--stream=mjpeg')
        async with self.joined(simulator) as browser:
            with Pictures(simulator) as pictures:
                before = await pictures.next_soon()
                await pictures.next_soon()
                for mouse in ('mouse -1 0 1 100 100 0 0', 'mouse 0 0 1 140 100 0 0', 'mouse 1 0 0 140 100 0 0', 'mouse 2 0 0 9 9 0 -1'):
                    await browser.send(mouse)
                for _ in range(8):
                    if await pictures.next_soon() != before:
                        break
                else:
                    self.fail('the picture stays the same')

    async def test_controls_and_reset(self):
        simulator = self.simulator('--stream=mjpeg')
        async with self.joined(simulator) as browser:
            await browser.send('step')
            self.assertEqual(await browser.reply(), 'paused by client')
            await browser.send('reset')
            self.assertEqual(await browser.reply(), 'reset finished')
            await browser.send('real-time:64')
            self.assertEqual(await browser.reply(), 'real-time')
            self.assertEqual(await browser.reply(), 'pause: 64')
            await browser.send('load:duel.wbt')
            self.assertEqual(await browser.reply(), 'delete world')
            self.assertTrue((await browser.until('world:')).startswith('world:worlds/duel.wbt:'))
            self.assertEqual(await browser.receive(), 'scene load completed')
        for line in (b'step', b'pause', b'reset', b'real-time', b'pause'):
            simulator.lines_until(line)

    async def test_a_reader_that_does_not_read_stops_nobody(self):
        simulator = self.simulator('--stream=mjpeg')
        async with self.joined(simulator, '1920x1200') as browser:
            # Sixty pictures are more than the kernel keeps for a peer that does not read them.
            with Pictures(simulator) as reader, Pictures(simulator, receive_buffer=4096):
                await browser.send('real-time:-1')
                self.assertGreater(len({await reader.next_soon() for _ in range(60)}), 30)
        with open(f'/proc/{simulator.process.pid}/status', encoding='ascii') as status:
            resident = next(line for line in status if line.startswith('VmRSS'))
        if 'asan' not in simulator_process.binary:
            self.assertLess(int(resident.split()[1]), 200_000, 'kB')


class Http(Case):
    def get(self, simulator, path, headers=None, method='GET'):
        connection = http.client.HTTPConnection('127.0.0.1', simulator.port, timeout=PATIENCE)
        try:
            connection.putrequest(method, path, skip_host=bool(headers and 'Host' in headers))
            for name, value in (headers or {}).items():
                connection.putheader(name, value)
            connection.endheaders()
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def test_files_of_the_project(self):
        simulator = self.simulator('--stream=w3d')
        status, headers, body = self.get(simulator, '/worlds/arena.wbt?x=1')
        with open(simulator_process.ARENA, 'rb') as file:
            self.assertEqual(body, file.read())
        self.assertEqual(status, 200)
        self.assertEqual(headers['Access-Control-Allow-Origin'], '*')
        self.assertEqual(headers['Cache-Control'], 'public, max-age=3600')
        self.assertEqual(headers['Content-Type'], 'application/octet-stream')
        self.assertRegex(headers['etag'], r'^[0-9a-f]{32}$')
        status, headers, body = self.get(simulator, '/worlds/arena.wbt', {'If-None-Match': headers['etag']})
        self.assertEqual((status, body), (304, b''))

    def test_types_redirection_and_nothing_outside_the_project(self):
        with tempfile.TemporaryDirectory() as folder:
            project = os.path.join(folder, 'project')
            shutil.copytree(os.path.join(PROJECTS, 'robots'), project)
            with open(os.path.join(folder, 'secret.txt'), 'w', encoding='ascii') as file:
                file.write('secret')
            os.symlink('../secret.txt', os.path.join(project, 'link.txt'))
            with open(os.path.join(project, 'a b.css'), 'w', encoding='ascii') as file:
                file.write('url(webots://x.png) url(webots://y.png)')
            simulator = self.simulator('--stream=w3d', world=os.path.join(project, 'worlds', 'arena.wbt'))
            status, headers, body = self.get(simulator, '/a%20b.css', {'Host': 'sim.example:2001'})
            self.assertEqual((status, headers['Content-Type']), (200, 'text/css'))
            self.assertEqual(body, b'url(http://sim.example:2001/x.png) url(http://sim.example:2001/y.png)')
            for path in ('/../secret.txt', '/%2e%2e/secret.txt', '/link.txt', '/worlds/../../secret.txt', '//etc/passwd', '/worlds',
                         '/%00', '/%zz', '/missing', '/protos/'):
                status, headers, body = self.get(simulator, path)
                self.assertEqual(status, 404, path)
                self.assertIn(b'404: File Not Found', body)
                self.assertEqual(headers['Access-Control-Allow-Origin'], '*')

    def test_connections_stay_open(self):
        simulator = self.simulator('--stream=w3d')
        connection = http.client.HTTPConnection('127.0.0.1', simulator.port, timeout=PATIENCE)
        for path in ('/index.html', '/webots.yml', '/missing'):
            connection.request('GET', path)
            connection.getresponse().read()
            self.assertIsNotNone(connection.sock)
        connection.close()

    def test_there_are_no_pictures_in_scene_mode_and_no_project_files_in_picture_mode(self):
        self.assertEqual(self.get(self.simulator('--stream=w3d'), '/mjpeg')[0], 404)
        self.assertEqual(self.get(self.simulator('--stream=mjpeg'), '/worlds/arena.wbt')[0], 404)

    def test_other_methods_find_nothing(self):
        self.assertEqual(self.get(self.simulator(), '/worlds/arena.wbt', method='DELETE')[0], 404)

    def test_extern_controllers_are_answered(self):
        for faults, answer in (('', b'FAILED'), ('never-ready', b'PROCESSING')):
            simulator = Simulator(faults=faults)
            self.addCleanup(simulator.end)
            if not faults:
                simulator.ready()
            with socket.create_connection(('127.0.0.1', simulator.port), timeout=PATIENCE) as peer:
                peer.sendall(b'CT')
                wait_until(lambda: has_read_all(peer), 'the first half is not read')
                peer.sendall(b'R\nRobot-Name: blue\n\n')
                self.assertEqual(peer.recv(100), answer)

    def test_garbage_on_the_port_is_survived(self):
        simulator = self.simulator()
        for garbage in (b'\x00' * 1000, os.urandom(5000), b'GET ' + b'a' * 100000, b'GET / HTTP/9.9\r\n\r\n', b'C', b'\r\n\r\n',
                        b'GET / HTTP/1.1\r\nUpgrade: websocket\r\nConnection: upgrade\r\n\r\n',
                        b'POST / HTTP/1.1\r\nContent-Length: 9999999999\r\n\r\nabc'):
            with socket.create_connection(('127.0.0.1', simulator.port), timeout=PATIENCE) as peer:
                try:
                    peer.sendall(garbage)
                    peer.shutdown(socket.SHUT_WR)
                    while peer.recv(65536):
                        pass
                except OSError:
                    pass
        self.assertEqual(self.get(simulator, '/index.html')[0], 200)


class Cost(Case):
    def cpu_seconds(self, simulator):
        with open(f'/proc/{simulator.process.pid}/stat', 'rb') as stat:
            fields = stat.read().rpartition(b')')[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')

    async def test_a_paused_simulator_with_clients_uses_no_processor_time(self):
        simulator = self.simulator('--stream=mjpeg', '--heartbeat=100')
        async with connect(simulator) as ws:
            await ws.send('mjpeg: 320x240')
            with Pictures(simulator) as pictures:
                await asyncio.get_running_loop().run_in_executor(None, pictures.next)
                await asyncio.get_running_loop().run_in_executor(None, pictures.next)
                before = self.cpu_seconds(simulator)
                for _ in range(10):
                    await asyncio.to_thread(simulator.lines_until, b'.')
                self.assertLessEqual(self.cpu_seconds(simulator) - before, 0.02)


if __name__ == '__main__':
    simulator_process.main()
