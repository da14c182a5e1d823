#!/usr/bin/python3
"""Projects that are fetched for later starts, from a real git server. Protocol sections 4.1.1 to 4.1.4."""

import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support.browser_client import Browser  # noqa: E402
from support.git_probe import WORLD  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.servers import SimulationServer, main, wait_until  # noqa: E402

FILES = {"worlds/arena.wbt": WORLD, "controllers/walk/walk.py": "print('walk')\n", "big.bin": os.urandom(200_000)}


class FetchOnly(unittest.IsolatedAsyncioTestCase):
    @classmethod
    def setUpClass(cls):
        cls.git = GitServer()
        cls.addClassCleanup(cls.git.close)
        cls.git.start()
        cls.git.add_repository("owner", "robots", FILES)
        cls.world = f"{cls.git.url}/owner/robots/blob/main/worlds/arena.wbt"

    def transfers(self, since=0):
        """The answers of the git server that were larger than a list of refs."""
        return [request for request in self.git.requests()[since:] if request[3] > 10_000]

    async def fetch(self, simulation, **more):
        async with Browser(simulation) as page:
            await page.start(self.world, fetch_only=True, **more)
            code = await page.hear_all()
            return page.told, code

    async def test_the_next_starts_of_the_project_fetch_nothing(self):
        with SimulationServer(forges=[self.git.url], allowedRepositories=[self.git.url]) as simulation:
            told, code = await self.fetch(simulation)
            self.assertEqual((told[-1], code), ("fetched:", 1000), told)
            self.assertTrue(self.transfers(), self.git.requests())
            simulation.wait_until_clean()  # no simulator, no copy of the project
            self.assertNotIn("Starting simulation", simulation.log())
            before = len(self.git.requests())
            for _ in range(2):
                async with Browser(simulation) as browser:
                    await browser.start(self.world)
                    await browser.hear("webots:")
            self.assertEqual(self.transfers(before), [])
            self.assertEqual(len(self.git.requests()) - before, 2)  # each asked what the branch is now
            told, code = await self.fetch(simulation)
            self.assertEqual((told, code), (["fetched:"], 1000))
            self.assertEqual(self.transfers(before), [])
            figures = simulation.get("/metrics")
            self.assertIn('webots_prefetches_total{result="fetched",reason=""} 2\n', figures)
            self.assertIn('webots_starts_total{result="ready",reason=""} 2\n', figures)
            simulation.wait_until_clean()

    async def test_a_page_that_leaves_gives_the_place_back(self):
        with SimulationServer(forges=[self.git.url], allowedRepositories=[self.git.url], maxConnections=1) as simulation:
            async with Browser(simulation) as page:
                await page.start(self.world, fetch_only=True)
            wait_until(lambda: "Client disconnected" in simulation.log(), simulation.log)
            simulation.wait_until_clean()
            async with Browser(simulation) as browser:
                await browser.start(self.world)
                await browser.hear("webots:")


if __name__ == "__main__":
    main()
