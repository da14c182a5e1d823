#!/usr/bin/python3
"""Requests of a browser to its running simulation: reset a controller, and reconnect after the connection was lost.

Protocol sections 4.1.1 and 4.1.4.
"""

import glob
import json
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import SimulationServer, is_alive, main, wait_until  # noqa: E402

CONTROLLER = "avoid_walls/avoid_walls.py"
PRISTINE = demo_project()["controllers/" + CONTROLLER]


async def reset(browser, value=CONTROLLER):
    await browser.socket.send(json.dumps({"reset controller": value}))


class ResetController(unittest.IsolatedAsyncioTestCase):
    async def check(self, simulation, **start):
        async with Browser(simulation) as browser:
            await browser.start(**start)
            await browser.hear("webots:")
            [path] = glob.glob(os.path.join(simulation.instances_folder(), "**", "controllers", CONTROLLER), recursive=True)
            with open(path, "w") as file:
                file.write("broken")
            await reset(browser)
            self.assertEqual(await browser.hear("reset controller:"), "reset controller: " + CONTROLLER)
            with open(path, "rb") as file:
                self.assertEqual(file.read(), PRISTINE)
            for value in ("avoid_walls/nothing.py", "../worlds/arena.wbt", "/etc/passwd"):
                await reset(browser, value)
                await browser.hear("loading: Error: ")
            await reset(browser)  # and the simulation goes on
            await browser.hear("reset controller:")
        simulation.wait_until_clean()

    async def test_of_a_project_in_a_folder(self):
        with server() as simulation:
            await self.check(simulation)

    async def test_of_a_project_from_git(self):
        with GitServer() as git:
            git.add_repository("school", "class", demo_project("projects/robots"))
            with SimulationServer(forges=[git.url], allowedRepositories=[git.url]) as simulation:
                await self.check(simulation, url=f"{git.url}/school/class/blob/main/projects/robots/worlds/arena.wbt")


class LostConnections(unittest.IsolatedAsyncioTestCase):
    async def lose(self, browser):
        """Breaks the connection without a close frame."""
        browser.socket.transport.abort()

    async def test_a_browser_returns_to_its_running_simulation(self):
        with server(reconnectGrace=60) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                token = (await browser.hear("reconnectToken: ")).split()[1]
                address = browser.told[-2]
                processes = simulation.simulators()
                await self.lose(browser)
            wait_until(lambda: "it may return for 60.0 s" in simulation.log(), "the loss went unnoticed")
            self.assertIn("waiting for its browser", simulation.get("/monitor"))
            async with Browser(simulation) as browser:
                await browser.socket.send(json.dumps({"reconnect": token}))
                self.assertEqual(await browser.hear("webots:"), address)
                self.assertTrue(browser.told[0].startswith("shutdownTimeout: 7"), browser.told)
                self.assertEqual(simulation.simulators(), processes)
            simulation.wait_until_clean()  # it closed, in order
            self.assertFalse([pid for pid in processes if is_alive(pid)])

    async def test_a_page_that_can_return_is_waited_for_also_when_it_is_reloaded_and_without_any_configuration(self):
        with server() as simulation:
            async with Browser(simulation) as browser:
                await browser.start(reconnect=True, heartbeat=True)
                token = (await browser.hear("reconnectToken: ")).split()[1]
                self.assertEqual(browser.told[0], "heartbeat: 1")
                await browser.hear(".")
                processes = simulation.simulators()
                await browser.socket.close(1001)
            wait_until(lambda: "it may return for 30.0 s" in simulation.log(), "nobody waits for it")
            async with Browser(simulation) as browser, Browser(simulation) as other:
                await browser.socket.send(json.dumps({"reconnect": token}))
                await browser.hear("reconnectToken: ")
                self.assertEqual(simulation.simulators(), processes)
                await other.socket.send(json.dumps({"reconnect": token}))
                await other.hear("reconnectToken: ")
                await browser.hear_all()
                self.assertEqual(browser.socket.close_code, 4001)
                await other.socket.close(1000)
            simulation.wait_until_clean()

    async def test_the_goodbye_of_a_proxy_that_reloads_is_not_that_of_the_visitor(self):
        with server() as simulation:
            async with Browser(simulation) as browser:
                await browser.start(reconnect=True)
                token = (await browser.hear("reconnectToken: ")).split()[1]
                processes = simulation.simulators()
                browser.socket.transport.write(b"\x88\x02\x03\xe9")  # as Caddy: 1001, not masked, and the end
                browser.socket.transport.close()
            wait_until(lambda: "it may return for 30.0 s" in simulation.log(), "nobody waits for the visitor")
            async with Browser(simulation) as browser:
                await browser.socket.send(json.dumps({"reconnect": token}))
                await browser.hear("reconnectToken: ")
                self.assertEqual(simulation.simulators(), processes)
            simulation.wait_until_clean()

    async def test_a_page_that_does_not_say_so_is_not_waited_for(self):
        with server() as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                await self.lose(browser)
            simulation.wait_until_clean()
            self.assertIn("it is ended at once, since there is no \"reconnectGrace\"", simulation.log())

    async def test_who_does_not_return_loses_the_simulation(self):
        with server(reconnectGrace=0.2) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                token = (await browser.hear("reconnectToken: ")).split()[1]
                await self.lose(browser)
            simulation.wait_until_clean()
            async with Browser(simulation) as browser:
                await browser.socket.send(json.dumps({"reconnect": token}))
                await browser.hear_all()
                self.assertEqual(browser.told[0], 'reason: {"code":"ended","values":{}}')
                self.assertEqual(browser.told[1:], ["loading: Error: This simulation has ended. Please start it again."])

    async def test_a_server_that_stops_does_not_wait(self):
        with server(reconnectGrace=600) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("reconnectToken: ")
                processes = simulation.simulators()
                await self.lose(browser)
            wait_until(lambda: "it may return for 600.0 s" in simulation.log(), "the loss went unnoticed")
            self.assertEqual(simulation.stop(), 0)
            self.assertFalse([pid for pid in processes if is_alive(pid)])
            self.assertEqual(simulation.instances(), [])


if __name__ == "__main__":
    main()
