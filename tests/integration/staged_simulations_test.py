#!/usr/bin/python3
"""Simulations that are ready before anybody asks (the key `staged`), with real servers and the demo simulator."""

import contextlib
import json
import os
import re
import shutil
import signal
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, Browser, server  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import SimulationServer, is_alive, main, wait_until  # noqa: E402


def staged(count=1, **more):
    return [{"url": WORLD, "count": count, **more}]


def rows(simulation):
    """Of the monitor: a simulation each, with its number, state and process."""
    return json.loads(simulation.get("/monitor", {"Accept": "application/json"}))["simulations"]


def ready(simulation):
    """The processes of the staged simulations that are ready."""
    return [row["process"] for row in rows(simulation) if row["state"] == "staged"]


def figure(simulation, name):
    return float(re.search(rf"^{name} (\S+)$", simulation.get("/metrics"), re.M)[1])


def wait_until_ready(simulation, count, *others):
    """The processes of so many staged simulations; `others`: of former ones, which the monitor may still show for a moment."""
    def are_ready():
        processes = ready(simulation)
        return processes if len(processes) == count and not set(processes) & set(others) else None

    return wait_until(are_ready, "other simulations are to be ready")


class Staged(unittest.IsolatedAsyncioTestCase):
    async def check_that_a_browser_gets_it(self, **walls):
        with server(staged=staged(), **walls) as simulation:
            [before] = wait_until_ready(simulation, 1)
            self.assertEqual(figure(simulation, "webots_simulations_staged"), 1)
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual([text for text in browser.told if text.startswith("loading:")], [])
                self.assertTrue(is_alive(before))
                [mine] = [row for row in rows(simulation) if row.get("process") == before]
                self.assertEqual(mine["state"], "idle")
                self.assertEqual(figure(simulation, "webots_staged_taken_total"), 1)
                [after] = wait_until_ready(simulation, 1, before)
            wait_until(lambda: not is_alive(before), "its browser has left")
            simulation.stop()
            wait_until(lambda: not is_alive(after), "the server has ended")

    async def test_a_browser_gets_it_and_the_next_one_is_made(self):
        await self.check_that_a_browser_gets_it()

    @unittest.skipUnless(shutil.which("bwrap") and shutil.which("slirp4netns") and os.geteuid() == 0, "needs bubblewrap, slirp4netns and root")
    async def test_so_it_is_in_a_sandbox_behind_the_gateway(self):
        await self.check_that_a_browser_gets_it(sandbox="bubblewrap", network="internet", gateway=True)

    async def test_one_that_is_killed_is_replaced_with_longer_and_longer_pauses(self):
        with server(staged=staged()) as simulation:
            [first] = wait_until_ready(simulation, 1)
            os.kill(first, signal.SIGKILL)
            wait_until(lambda: not is_alive(first), "it was killed")
            [second] = wait_until_ready(simulation, 1, first)
            for process in simulation.simulators():  # what a killed guard leaves is ended, too
                with contextlib.suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
            wait_until_ready(simulation, 1, first, second)
            self.assertEqual(len(simulation.instances()), 1)

    async def test_a_full_machine_gives_them_back_and_browsers_get_all_places(self):
        with server(staged=staged(2), maxConnections=3, simulationsPerAddress=0) as simulation:
            before = wait_until_ready(simulation, 2)
            async with contextlib.AsyncExitStack() as stack:
                for _ in range(3):
                    browser = await stack.enter_async_context(Browser(simulation))
                    await browser.start(mode="x3d")  # another one than the staged ones
                    await browser.hear("webots:")
                self.assertEqual([process for process in before if is_alive(process)], [])
                self.assertEqual(len(rows(simulation)), 3)
                async with Browser(simulation) as late:
                    await late.start()
                    await late.hear("loading: Error: Too many open connections")
            wait_until_ready(simulation, 2)

    async def test_a_server_that_drains_has_none_and_ends(self):
        with server(staged=staged(2)) as simulation:
            before = wait_until_ready(simulation, 2)
            simulation.process.send_signal(signal.SIGUSR1)
            simulation.wait_until_clean()
            self.assertEqual([process for process in before if is_alive(process)], [])

    async def test_a_killed_server_leaves_none_and_the_next_one_has_its_own(self):
        with server(staged=staged(2)) as simulation:
            before = wait_until_ready(simulation, 2)
            simulation.process.kill()
            simulation.process.wait()
            wait_until(lambda: not any(is_alive(process) for process in before), "simulators outlive their server")
            simulation.start()
            after = wait_until_ready(simulation, 2)
            self.assertEqual(len(simulation.instances()), 2)
            self.assertFalse(set(before) & set(after))

    async def test_a_reread_configuration_changes_what_is_staged(self):
        with server() as simulation:
            simulation.reread(staged=staged(2))
            wait_until_ready(simulation, 2)
            simulation.reread(staged=[])
            simulation.wait_until_clean()

    async def test_a_new_commit_replaces_them_when_a_start_has_seen_it(self):
        with GitServer() as git:
            path = git.add_repository("school", "class", demo_project("projects/robots"))
            world = f"{git.url}/school/class/blob/main/projects/robots/worlds/arena.wbt"
            with SimulationServer(forges=[git.url], allowedRepositories=[git.url], staged=[{"url": world}]) as simulation:
                [before] = wait_until_ready(simulation, 1)
                git.commit(path, {**demo_project("projects/robots"), "projects/robots/notes.txt": "new"})
                async with Browser(simulation) as browser:
                    await browser.start(url=world, mode="x3d")
                    await browser.hear("webots:")
                    wait_until_ready(simulation, 1, before)
                    self.assertFalse(is_alive(before))


if __name__ == "__main__":
    main()
