#!/usr/bin/python3
"""A site of one machine, as the configurations that ship have it, whose machine refuses: whoever starts a simulation is told why, once, and the
session server's log has it, too. Real servers and the demo simulator; the decision is in the unit tests of client_relay."""

import asyncio
import json
import os
import re
import shutil
import sys
import tempfile
import unittest
import unittest.mock

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.browser_client import LOCAL  # noqa: E402
from support.disks import mount_small_disk  # noqa: E402
from support.projects import EXAMPLES, local_config  # noqa: E402
from support.refusals import pattern  # noqa: E402
from support.servers import Server, SessionServer, SimulationServer, main, wait_until  # noqa: E402
from support.visitor import Visitor  # noqa: E402

ERROR = "loading: Error: "
FORGE = "http://127.0.0.1:9"  # where nobody listens
WORLD_OF_THE_FORGE = {"start": {"url": f"{FORGE}/o/r/blob/main/worlds/a.wbt", "mode": "mjpeg", "waiting": True}}


class RefusedStarts(unittest.IsolatedAsyncioTestCase):
    def folder(self):
        return self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_refused_"))

    async def site(self, environment=None, **settings):
        """What ./server.sh start starts, but for the ports and what the test changes."""
        shipped = {key: value for key, value in local_config("simulation").items() if key not in ("$schema", "port")}
        shipped["projectsDir"] = os.path.abspath(EXAMPLES)
        machine = {**shipped, **LOCAL, "sandbox": "auto", "simulationUser": "auto", **settings}
        self.machine = self.enterContext(SimulationServer(environment=environment, **machine))
        self.session = self.enterContext(SessionServer([self.machine.address], relay=local_config("session")["relay"]))
        await asyncio.to_thread(wait_until, lambda: 'webots_servers{state="up"} 1\n' in self.session.get("/metrics"), lambda: self.session.log())

    async def visit(self, message=None):
        """Somebody who asks for the demo's world, or sends this message."""
        visitor = await self.enterAsyncContext(Visitor(self.session))
        if message is None:
            await visitor.start(waiting=True)
        else:
            await visitor.open(await visitor.ask())
            await visitor.say(**message)
        return visitor

    async def assert_refused(self, why, message=None):
        """A new visitor is told this at last, and no other error. (In its first moments a session server has everybody wait.)"""
        visitor = await self.visit(message)
        await visitor.hear_end()
        await self.assert_told(visitor, why)

    async def assert_told(self, visitor, why):
        self.assertEqual(len(visitor.errors()), 1, visitor.told)
        self.assertRegex(visitor.errors()[0].removeprefix(ERROR), why)
        self.assertEqual(visitor.told[-1], visitor.errors()[0])
        logged = rf"{self.machine.address} refuses a start: {why}"
        await asyncio.to_thread(wait_until, lambda: re.search(logged, self.session.log()), self.session.log)
        # The monitor's texts are as old as a second.
        await asyncio.to_thread(wait_until, lambda: re.match(why, self.refusal() or ""), self.refusal)
        self.assertEqual(self.session.get("/readyz"), "ready, but: every machine refused its last start: see /monitor and the log")

    def refusal(self):
        """What the monitor says that the machine refused its last start with."""
        return json.loads(self.session.get("/monitor", {"Accept": "application/json"}))["servers"][0].get("refusal")

    async def test_a_world_outside_the_allowed_repositories(self):
        await self.site(allowedRepositories=["https://github.com/cyberbotics"])
        await self.assert_refused("Docker not enabled: cannot host simulations from repositories outside of")

    def webots(self, script):
        """A "webotsHome" whose program is this shell script."""
        home = self.folder()
        os.chmod(home, 0o755)
        program = os.path.join(home, "webots")
        with open(program, "w") as file:
            file.write("#!/bin/sh\n" + script)
        os.chmod(program, 0o755)
        return home

    async def test_a_world_of_others_where_idle_time_is_not_shared(self):
        if not shutil.which("bwrap") or not shutil.which("Xvfb"):
            self.skipTest("there is no sandbox with a display of its own (packages bubblewrap, xvfb)")
        # Limits that hold, also where a server made with sanitizers has none by itself: without them idle time is not the reason.
        await self.site(allowedRepositories=["https://github.com/cyberbotics"], shareIdleTime=0, sandbox="bubblewrap", display="private",
                        simulationMemory=4096)
        await self.assert_refused("This simulation server is not configured to share idle time")

    async def test_a_simulator_that_does_not_start(self):
        await self.site(webotsHome=self.webots("echo 'error: cannot open display' >&2\nexit 1\n"))
        await self.assert_refused(pattern("ended_early_saying", words="error: cannot open display"))

    async def test_a_simulator_that_crashes_while_it_loads(self):
        await self.site(webotsHome=self.webots("sleep 0.5\nkill -SEGV $$\n"))
        await self.assert_refused(pattern("ended_early"))

    async def test_a_forge_that_can_not_be_reached(self):
        await self.site(forges=[FORGE], allowedRepositories=[FORGE])
        visitor = await self.visit(WORLD_OF_THE_FORGE)
        await visitor.hear_end()
        self.assertRegex(visitor.told[-1], "can't be reached")

    async def test_a_proxy_that_can_not_be_reached(self):
        dead = "http://127.0.0.1:9"
        await self.site(environment={"https_proxy": dead, "HTTPS_PROXY": dead, "no_proxy": ""}, forges=["https://github.com"],
                        allowedRepositories=["https://github.com/cyberbotics"])
        world = "https://github.com/cyberbotics/webots/blob/R2023b/projects/samples/demos/worlds/soccer.wbt"
        visitor = await self.visit({"start": {"url": world, "mode": "mjpeg", "waiting": True}})
        await visitor.hear_end()
        self.assertEqual(len(visitor.errors()), 1, visitor.told)
        self.assertRegex(visitor.told[-1], "proxy|can't be reached")

    async def test_a_folder_of_the_cache_that_can_not_be_used(self):
        home, state = self.folder(), self.folder()
        for path in (os.path.join(home, "webots_cloud"), os.path.join(state, "cache")):
            with open(path, "w") as file:
                file.write("no folder")
        await self.site(environment={"XDG_CACHE_HOME": home}, stateDir=state, forges=[FORGE], allowedRepositories=[FORGE])
        await self.assert_refused("This server can't store projects", WORLD_OF_THE_FORGE)

    async def test_a_key_of_a_website_that_can_not_be_read(self):
        keys = self.folder()
        os.symlink("/proc/self/mem", os.path.join(keys, "localhost"))  # a file that root can't read either
        await self.site(keyDir=keys)
        await self.assert_refused(".*can't read the key", {"init": ["http://localhost", "robots", "arena.wbt", "42", "Ada", "secret", "", "", "custom"]})

    async def test_a_server_that_is_stopped_meanwhile(self):
        await self.site(webotsHome=self.webots("echo loading\nsleep 100\n"))
        visitor = await self.visit()
        await asyncio.to_thread(wait_until, self.machine.instances, self.machine.log)
        await asyncio.to_thread(self.machine.stop)
        await visitor.hear_end()
        self.assertEqual(len(visitor.errors()), 1, visitor.told)
        self.assertRegex(visitor.told[-1], "is being stopped. Please start again")

    async def test_a_full_disk_and_when_there_is_room_again(self):
        state = self.folder()
        mount_small_disk(self, state, "2m")
        filler = os.path.join(state, "filler")
        await self.site(stateDir=state)
        with open(filler, "wb") as file:
            with self.assertRaises(OSError):
                while True:
                    os.write(file.fileno(), bytes(4096))
        await self.assert_refused(".*(No space left on device|disk)")
        os.remove(filler)
        visitor = await self.visit()
        await visitor.hear("webots:")
        await asyncio.to_thread(wait_until, lambda: self.session.get("/readyz") == "ready", self.session.log)
        await asyncio.to_thread(wait_until, lambda: self.refusal() is None, self.refusal)

    @unittest.skipIf(os.geteuid() != 0, "only root has simulations run as other users")
    async def test_a_shell_whose_new_files_are_private(self):
        self.enterContext(unittest.mock.patch.object(Server, "umask", 0o077))
        await self.site()
        visitor = await self.visit()
        await visitor.hear("webots:")


if __name__ == "__main__":
    main()
