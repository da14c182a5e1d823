#!/usr/bin/python3
"""Simulations that are ready before anybody asks (the key `staged`), with real servers and the demo simulator."""

import asyncio
import collections
import contextlib
import json
import math
import os
import re
import shutil
import signal
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import web_sockets as websockets  # noqa: E402
from support.browser_client import PATIENCE, WORLD, Browser, server  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.projects import EXAMPLES, demo_project  # noqa: E402
from support.servers import SimulationServer, is_alive, main, program, wait_until  # noqa: E402

# How often the worlds of a hostile repository are staged; 200 take some minutes, on a machine that is busy half an hour.
HOSTILE_STAGINGS = int(os.environ.get("HOSTILE_STAGINGS", "30"))
HOSTILE_WORLDS = max(24, HOSTILE_STAGINGS // 4)  # one is tried some six times in a minute


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

    async def test_the_server_fetches_no_pictures_that_nobody_has_asked_for(self):
        """Their simulators would end, as Webots does."""
        with server(staged=staged(), gateway=True, simulationsPerAddress=0) as simulation:
            wait_until_ready(simulation, 1)
            async with Browser(simulation) as silent, Browser(simulation) as browser:
                await silent.start(url=WORLD.replace("arena", "corridor"))
                address = (await silent.hear("webots:")).removeprefix("webots:")
                async with websockets.connect(f"{address}/") as viewer:
                    await viewer.send("real-time:-1")  # it runs, and draws nothing
                    wait_until(lambda: "running" in [row["state"] for row in rows(simulation)], lambda: rows(simulation))
                    before = [row["process"] for row in rows(simulation)]
                    await browser.start(url=WORLD.replace("arena", "duel"), size="320x240", run=True)
                    await browser.hear("webots:")
                    # It is the youngest one: pictures of the others would have been taken before.
                    wait_until(lambda: json.loads(simulation.get("/worlds")).get("pictures"), "a picture for the gallery")
                    self.assertEqual([is_alive(process) for process in before], [True, True], simulation.log())

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

    async def test_a_changed_folder_replaces_them_before_anybody_asks(self):
        with tempfile.TemporaryDirectory(prefix="webots_cloud_staged_") as folder:
            project = os.path.join(folder, "school", "robots")
            shutil.copytree(os.path.join(EXAMPLES, "robots"), project)
            world = "local:/school/robots/blob/main/worlds/arena.wbt"
            with SimulationServer(forges=[{"url": "local:", "directory": folder}], allowedRepositories=["local:"],
                                  staged=[{"url": world}]) as simulation:
                [before] = wait_until_ready(simulation, 1)
                with open(os.path.join(project, "notes.txt"), "w") as file:
                    file.write("new")
                wait_until_ready(simulation, 1, before)
                wait_until(lambda: not is_alive(before), "the old one is still there")


# What simulators of the worlds do, by the beginning of their names; one more, `never`, does not get ready.
HOSTILE = {"exit": "exit-before-ready", "crash": "crash", "garbage": "binary-lines,long-lines,exit-before-ready=3", "die": "exit-after-ready=1",
           "fork": "grandchild,daemon-grandchild,exit-before-ready"}
WEBOTS = """#!/bin/sh
for world; do :; done
name=$(basename "$world" .wbt)
echo "$name $(date +%s)" >> "{starts}"
case $name in
{cases}
esac
exec "{demo}" --demo-faults="$faults" "$@"
"""


class HostileRepository(unittest.IsolatedAsyncioTestCase):
    def make(self, folder):
        """A repository of hostile worlds and a good one, and a Webots that does what their names say."""
        worlds = os.path.join(folder, "school", "hostile", "worlds")
        shutil.copytree(os.path.join(EXAMPLES, "robots"), os.path.dirname(worlds))
        kinds = [*HOSTILE]
        self.names = [*(f"{kinds[number % len(kinds)]}{number}" for number in range(HOSTILE_WORLDS - 1)), "never0"]
        for name in self.names:
            shutil.copy(os.path.join(worlds, "arena.wbt"), os.path.join(worlds, f"{name}.wbt"))
        home = os.path.join(folder, "home")
        os.mkdir(home)
        self.starts_file = os.path.join(folder, "starts")
        cases = "\n".join(f"{name}*) faults={faults};;" for name, faults in {**HOSTILE, "never": "never-ready"}.items())
        with open(os.path.join(home, "webots"), "w") as file:
            file.write(WEBOTS.format(starts=self.starts_file, cases=cases, demo=program("webots-demo-simulator")))
        os.chmod(os.path.join(home, "webots"), 0o755)
        return {"webotsHome": home, "forges": [{"url": "local:", "directory": folder}], "allowedRepositories": ["local:"]}

    @staticmethod
    def address(name):
        return f"local:/school/hostile/blob/main/worlds/{name}.wbt"

    def starts(self):
        """How often each hostile world was started."""
        with open(self.starts_file) as file:
            return collections.Counter(line.split()[0] for line in file if not line.startswith("arena"))

    async def test_what_fails_is_tried_seldom_and_leaves_nothing_while_others_go_on(self):
        with tempfile.TemporaryDirectory(prefix="webots_cloud_hostile_") as folder:
            settings = self.make(folder)
            with SimulationServer(**settings, maxConnections=4, startTimeout=10, simulationsPerAddress=0) as simulation:
                async with Browser(simulation) as bystander:
                    await bystander.start(self.address("arena"))
                    await bystander.hear("webots:")
                    [process] = [row["process"] for row in rows(simulation)]
                    began = time.time()
                    good = {"url": self.address("arena"), "count": 1}
                    simulation.reread(staged=[good, *({"url": self.address(name)} for name in self.names)])
                    # Other tests keep the processors busy, and so nothing is staged for most of the time.
                    await asyncio.to_thread(wait_until, lambda: len(self.starts()) == len(self.names) and self.starts().total() >= HOSTILE_STAGINGS, self.starts,
                                            max(PATIENCE, 10 * HOSTILE_STAGINGS))
                    seconds = time.time() - began
                    for name, count in self.starts().items():  # after 1, 2, 4 ... seconds
                        self.assertLessEqual(count, 1 + math.log2(seconds + 2), name)
                    self.assertEqual(len(ready(simulation)), 1)
                    async with Browser(simulation) as guest:
                        await guest.start(self.address("arena"))
                        await guest.hear("webots:")
                    self.assertTrue(is_alive(process))
                    simulation.reread(staged=[])
                    wait_until(lambda: len(rows(simulation)) == 1, lambda: rows(simulation))
                    self.assertTrue(is_alive(process))
                    self.assertEqual(len(simulation.instances()), 1)
                async with contextlib.AsyncExitStack() as stack:  # no seat is lost
                    for _ in range(4):
                        browser = await stack.enter_async_context(Browser(simulation))
                        await browser.start(self.address("arena"))
                        await browser.hear("webots:")
                simulation.wait_until_clean()


if __name__ == "__main__":
    main()
