#!/usr/bin/python3
"""A site of one machine, as the configurations that ship have it, whose machine refuses: whoever starts a simulation is told why, once, and the
session server's log has it, too. Real servers and the demo simulator; the decision is in the unit tests of client_relay."""

import asyncio
import json
import os
import re
import stat
import sys
import tempfile
import unittest
import unittest.mock

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.browser_client import server  # noqa: E402
from support.disks import mount_small_disk  # noqa: E402
from support.projects import local_config  # noqa: E402
from support.servers import Server, SessionServer, main, wait_until  # noqa: E402
from support.visitor import Visitor  # noqa: E402

ERROR = "loading: Error: "


class RefusedStarts(unittest.IsolatedAsyncioTestCase):
    def folder(self):
        return self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_refused_"))

    async def site(self, **machine):
        shipped = local_config("session")
        self.machine = self.enterContext(server(**machine))
        self.session = self.enterContext(SessionServer([self.machine.address], relay=shipped["relay"]))
        await asyncio.to_thread(wait_until, lambda: 'webots_servers{state="up"} 1\n' in self.session.get("/metrics"), lambda: self.session.log())

    async def visit(self):
        visitor = await self.enterAsyncContext(Visitor(self.session))
        await visitor.start(waiting=True)
        return visitor

    async def assert_refused(self, why):
        """A new visitor is told this at last, and no other error. (In its first moments a session server has everybody wait.)"""
        visitor = await self.visit()
        await visitor.hear_end()
        self.assertEqual(len(visitor.errors()), 1, visitor.told)
        self.assertRegex(visitor.errors()[0].removeprefix(ERROR), why)
        self.assertEqual(visitor.told[-1], visitor.errors()[0])
        logged = rf"{self.machine.address} refuses a start: {ERROR}{why}"
        await asyncio.to_thread(wait_until, lambda: re.search(logged, self.session.log()), self.session.log)
        # The monitor's texts are as old as a second.
        await asyncio.to_thread(wait_until, lambda: re.match(ERROR + why, self.refusal() or ""), self.refusal)
        self.assertEqual(self.session.get("/readyz"), "ready, but: every machine refused its last start: see /monitor and the log")

    def refusal(self):
        """What the monitor says that the machine refused its last start with."""
        return json.loads(self.session.get("/monitor", {"Accept": "application/json"}))["servers"][0].get("refusal")

    async def test_a_world_outside_the_allowed_repositories(self):
        await self.site(allowedRepositories=["https://github.com/cyberbotics"])
        await self.assert_refused("Docker not enabled: cannot host simulations from repositories outside of")

    async def test_a_simulator_that_does_not_start(self):
        home = self.folder()
        program = os.path.join(home, "webots")
        with open(program, "w") as file:
            file.write("#!/bin/sh\necho 'error: cannot open display' >&2\nexit 1\n")
        os.chmod(program, os.stat(program).st_mode | stat.S_IXUSR | stat.S_IXGRP | stat.S_IXOTH)
        await self.site(webotsHome=home)
        await self.assert_refused("Unable to start Webots: .*cannot open display")

    async def test_a_forge_that_can_not_be_reached(self):
        await self.site(forges=["http://127.0.0.1:9"], allowedRepositories=["http://127.0.0.1:9"])
        visitor = await self.enterAsyncContext(Visitor(self.session))
        await visitor.open(await visitor.ask())
        await visitor.say(start={"url": "http://127.0.0.1:9/o/r/blob/main/worlds/a.wbt", "mode": "mjpeg", "waiting": True})
        await visitor.hear_end()
        self.assertRegex(visitor.told[-1], "can't be reached")

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
