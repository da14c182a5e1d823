#!/usr/bin/python3
"""Controllers on other machines: from the address in the console to the robot that moves, through the real server.

Protocol section 13.18. The controller behaves as Webots' library up to its first request (`support/extern_controller.py`); what it says then is the
demo simulator's.
"""

import asyncio
import contextlib
import json
import os
import shutil
import sys
import tempfile
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import haproxy  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.extern_controller import NEW, OLD, ExternController  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402

try:
    from support import web_sockets as websockets
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-websockets)") or 77)

LONG = "a robot whose name does not fit into an address"
ROBOTS = ["e-puck", "Käfer 1", LONG]
WORLD = "#VRML_SIM R2025a utf8\nWorldInfo { basicTimeStep 32 }\n" + "".join(
    f'TwoWheeledRobot {{ name "{name}" translation {x} 0 0 controller "<extern>" }}\n' for x, name in enumerate(ROBOTS)) + \
    'TwoWheeledRobot { name "other" translation 0 -1 0 }\n'
URL = "local:/o/robots/blob/main/worlds/a.wbt"
OPEN = {"controllerRepositories": ["local:/o"]}


async def told(browser, robot):
    """What the console shows of this robot."""
    return await browser.hear(f'stdout:Robot "{robot}" waits for its controller')


async def address(browser, robot):
    return (await told(browser, robot)).partition("WEBOTS_CONTROLLER_URL=")[2]


async def watch(viewer, beginning):
    while True:
        message = await asyncio.wait_for(viewer.recv(), PATIENCE)
        if message.startswith(beginning):
            return message


def places(update):
    """Where each node of the scene is."""
    nodes = json.loads(update.partition(":")[2])["updates"]
    return {node["id"]: node["translation"] for node in nodes if "translation" in node}


class Controllers(unittest.IsolatedAsyncioTestCase):
    def start(self, **settings):
        folder = tempfile.mkdtemp(prefix="webots_cloud_controllers_")
        self.addCleanup(shutil.rmtree, folder)
        worlds = os.path.join(folder, "o", "robots", "worlds")
        os.makedirs(worlds)
        with open(os.path.join(worlds, "a.wbt"), "w") as file:
            file.write(WORLD)
        simulation = SimulationServer(**{"gateway": True, "forges": [{"url": "local:", "directory": folder}], "allowedRepositories": ["local:/o"],
                                         "controllerPort": free_port(), **settings})
        return self.enterContext(contextlib.closing(simulation))

    def open(self, **settings):
        simulation = self.start(**{**OPEN, **settings})
        simulation.start()
        return simulation

    @contextlib.asynccontextmanager
    async def simulating(self, simulation):
        """A browser whose simulation is ready, and a viewer of it."""
        async with Browser(simulation) as browser:
            await browser.start(url=URL, mode="x3d")
            url = (await browser.hear("webots:")).removeprefix("webots:")
            async with websockets.connect(url + "/", max_size=None) as viewer:
                await viewer.send("x3d;broadcast")
                await watch(viewer, "scene load completed")
                yield browser, viewer

    async def drive(self, browser, viewer, robot="e-puck", release=NEW):
        """From the console to a robot that stops and moves again when its controller says so."""
        url = await address(browser, robot)
        connection = await asyncio.to_thread(ExternController, url, release)
        with connection as controller:
            self.assertEqual(controller.answer, "CONNECTED")
            await watch(viewer, f"stdout:INFO: '{robot}' extern controller: connected.")
            self.assertEqual(await asyncio.to_thread(controller.say, "hello"), "hello")
            await watch(viewer, f"stdout:'{robot}' extern controller: hello")
            await viewer.send("real-time:-1")
            moving = await self.moved(viewer)
            self.assertEqual(await asyncio.to_thread(controller.say, "cruise 0"), "cruise 0")
            await watch(viewer, f"stdout:'{robot}' extern controller: cruise 0")
            await watch(viewer, "application/json:")  # the step under way may have been begun before
            self.assertEqual(len(moving - await self.moved(viewer)), 1, "one robot stands still")
            await viewer.send("pause")
        await watch(viewer, f"stdout:INFO: '{robot}' extern controller: disconnected.")

    async def moved(self, viewer):
        """The nodes that are elsewhere after some steps."""
        first = places(await watch(viewer, "application/json:"))
        for _ in range(5):
            last = places(await watch(viewer, "application/json:"))
        return {node for node in first if first[node] != last[node]}

    async def test_a_controller_drives_a_robot_of_a_simulation_without_walls(self):
        simulation = self.open()
        async with self.simulating(simulation) as (browser, viewer):
            await self.drive(browser, viewer)
        simulation.wait_until_clean()

    async def test_a_controller_drives_a_robot_in_a_sandbox_with_a_network_of_its_own(self):
        if not shutil.which("bwrap"):
            self.skipTest("bubblewrap is not installed")
        simulation = self.start(**OPEN, sandbox="bubblewrap", network="none")
        try:
            simulation.start()
        except AssertionError as failure:
            self.skipTest(f"no sandbox here: {failure}")
        async with self.simulating(simulation) as (browser, viewer):
            await self.drive(browser, viewer)
        simulation.wait_until_clean()

    async def test_robots_are_reached_by_their_names_whatever_these_are_and_however_the_library_sends_them(self):
        simulation = self.open()
        async with self.simulating(simulation) as (browser, viewer):
            urls = {robot: await address(browser, robot) for robot in ROBOTS}
            self.assertTrue(urls[LONG].endswith("/~3"), urls)
            for robot, url in urls.items():
                for release in (NEW, OLD):
                    with await asyncio.to_thread(ExternController, url, release) as controller:
                        self.assertEqual(controller.answer, "CONNECTED", (robot, release))
                        await watch(viewer, f"stdout:INFO: '{robot}' extern controller: connected.")
                    await watch(viewer, f"stdout:INFO: '{robot}' extern controller: disconnected.")
            written_by_hand = urls["e-puck"].replace("e-puck", "Käfer 1")
            with await asyncio.to_thread(ExternController, written_by_hand) as controller:
                self.assertEqual(controller.answer, "CONNECTED")

    async def test_what_is_said_is_relayed_as_it_is_and_waits_for_who_does_not_read(self):
        simulation = self.open()
        async with self.simulating(simulation) as (browser, _):
            with await asyncio.to_thread(ExternController, await address(browser, "e-puck")) as controller:
                line = bytes(byte for byte in range(256) if byte != ord("\n")) * 200 + b"\n"
                lines = 200  # ten megabytes, more than all sockets in between take
                teller = threading.Thread(target=lambda: [controller.socket.sendall(line) for _ in range(lines)])
                teller.start()
                heard = await asyncio.to_thread(controller.hear, lines * len(line))
                teller.join()
                self.assertTrue(heard == lines * line, "other bytes came back")

    async def test_who_is_not_let_in_hears_webots_own_words(self):
        simulation = self.open()
        async with self.simulating(simulation) as (browser, _):
            url = await address(browser, "e-puck")
            key = url.split("/")[3]

            def answer(url):
                with ExternController(url) as controller:
                    return controller.answer, controller.hear_all()

            for wrong in (url.replace(key, "x" * len(key)), url.replace(key, key[1:]), url.replace(key + "/", ""), url.partition("/" + key)[0]):
                word, rest = await asyncio.to_thread(answer, wrong)
                self.assertEqual(word, "FORBIDDEN:", wrong)
                self.assertRegex(rest.decode(), r"^ [A-Z].*\.\n$", wrong)
            self.assertEqual(await asyncio.to_thread(answer, url + "x"), ("FAILED", b""))
            self.assertEqual(await asyncio.to_thread(answer, url.replace("/e-puck", "")), ("FAILED", b""))  # several robots wait
            with await asyncio.to_thread(ExternController, url) as first:
                self.assertEqual(first.answer, "CONNECTED")
                self.assertEqual(await asyncio.to_thread(answer, url), ("FORBIDDEN", b""))
            self.assertNotIn(key, simulation.log())
        simulation.wait_until_clean()
        self.assertEqual((await asyncio.to_thread(answer, url))[0], "FORBIDDEN:")

    async def test_a_controller_loses_its_connection_when_the_simulation_ends(self):
        simulation = self.open()
        async with Browser(simulation) as browser:
            await browser.start(url=URL, mode="x3d")
            controller = await asyncio.to_thread(ExternController, await address(browser, "e-puck"))
        with controller:
            self.assertEqual(await asyncio.to_thread(controller.hear_all), b"")
        simulation.wait_until_clean()

    async def test_a_browser_that_returns_is_told_the_same_addresses(self):
        simulation = self.open(reconnectGrace=60)
        async with Browser(simulation) as browser:
            await browser.start(url=URL, mode="x3d")
            token = (await browser.hear("reconnectToken: ")).split()[1]
            url = await address(browser, "e-puck")
            browser.socket.transport.abort()
            await asyncio.to_thread(wait_until, lambda: "it may return for 60.0 s" in simulation.log(), "the loss went unnoticed")
            async with Browser(simulation) as again:
                await again.socket.send(json.dumps({"reconnect": token}))
                self.assertEqual(await address(again, "e-puck"), url)

    async def test_other_projects_get_no_key_and_their_authors_are_told(self):
        simulation = self.open(controllerRepositories=["local:/o/another"])
        async with Browser(simulation) as browser:
            await browser.start(url=URL, mode="x3d")
            line = await told(browser, "e-puck")
            self.assertIn("this site takes none of other machines for this project", line)
            self.assertNotIn("tcp://", line)

    async def test_a_session_server_passes_controllers_on_to_its_machines(self):
        door, inside = free_port(), free_port()
        machine, other = self.start(**OPEN, controllerPort=inside), self.open()
        machine.config["controllerAddress"] = f"localhost:{door}/{machine.port}"
        machine.start()
        entries = [{"address": f"localhost:{each.port}", "controllers": f"127.0.0.1:{each.config['controllerPort']}"} for each in (other, machine)]
        session = self.enterContext(contextlib.closing(SessionServer(entries, controllerPort=door, ssl=False, portRewrite=False)))
        session.start()
        async with self.simulating(machine) as (browser, viewer):
            url = await address(browser, "e-puck")
            self.assertTrue(url.startswith(f"tcp://localhost:{door}/{machine.port}/"), url)

            def answer(url):
                with ExternController(url) as controller:
                    return controller.answer, controller.hear_all()

            for elsewhere in (other.port, session.port, inside):
                wrong = url.replace(f"/{machine.port}/", f"/{elsewhere}/")
                self.assertEqual((await asyncio.to_thread(answer, wrong))[0], "FORBIDDEN:", wrong)
            self.assertEqual(await asyncio.to_thread(answer, url + "x"), ("FAILED", b""))
            for release in (NEW, OLD):
                with await asyncio.to_thread(ExternController, url, release) as controller:
                    self.assertEqual(controller.answer, "CONNECTED", release)
                    await watch(viewer, "stdout:INFO: 'e-puck' extern controller: connected.")
                await watch(viewer, "stdout:INFO: 'e-puck' extern controller: disconnected.")
            await self.drive(browser, viewer, "Käfer 1")

    async def test_the_port_may_be_reached_through_a_proxy_of_tcp_at_another_address(self):
        port, door = free_port(), free_port()
        self.enterContext(haproxy.streams({door: port}))
        simulation = self.open(controllerPort=port, controllerAddress=f"127.0.0.1:{door}")
        async with self.simulating(simulation) as (browser, viewer):
            self.assertTrue((await address(browser, "e-puck")).startswith(f"tcp://127.0.0.1:{door}/"))
            await self.drive(browser, viewer, "Käfer 1")


if __name__ == "__main__":
    main()
