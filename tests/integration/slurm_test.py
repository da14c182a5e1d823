#!/usr/bin/python3
"""Simulations that are jobs of a real Slurm cluster: docs/clusters.md."""

import asyncio
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server, websockets  # noqa: E402
from support.frames import PICTURE  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.servers import PATIENCE, descendants, end, is_alive, main, wait_until  # noqa: E402
from support.slurm import Cluster  # noqa: E402


def cluster_server(cluster, slurm=None, **settings):
    """A simulation server whose simulations are jobs."""
    return server(**{**jobs_of(cluster, slurm), **settings})


def jobs_of(cluster, slurm=None):
    return {"launcher": {"slurm": slurm or {}}, "gateway": True, "shareIdleTime": 100,
            "environment": {**cluster.environment, "WEBOTS_DEMO_ADDRESS": "0.0.0.0"}}


async def see_a_picture(address):
    """As a viewer does, in modes with pictures."""
    async with websockets.connect(address + "/", max_size=None) as viewer:
        await viewer.send("mjpeg: 320x240")
        await viewer.send("real-time:-1")
        await asyncio.to_thread(receive_picture, address)


def receive_picture(address):
    with urllib.request.urlopen(address.replace("ws://", "http://") + "/mjpeg", timeout=PATIENCE) as stream:
        received = b""
        while PICTURE not in received:
            received += stream.read1(1 << 16)


async def ready(browser, **start):
    """Starts a simulation; returns its address."""
    await browser.start(**start)
    return (await browser.hear("webots:"))[len("webots:"):]


class OneCluster(unittest.IsolatedAsyncioTestCase):
    """A cluster for all tests of a class, in which each leaves no job."""

    PROCESSORS = 1  # of each of the two nodes

    @classmethod
    def setUpClass(cls):
        cls.cluster = cls.enterClassContext(Cluster(processors=cls.PROCESSORS))

    def tearDown(self):
        self.cluster.wait_until_empty()
        wait_until(lambda: not self.cluster.steps(), "something of a job is left on a node")


class Jobs(OneCluster):
    async def test_a_browser_sees_its_simulation_and_leaves(self):
        with cluster_server(self.cluster, {"partition": "robots", "memory": 100}, timeout=3600) as simulation:
            async with Browser(simulation) as browser:
                address = await ready(browser)
                await see_a_picture(address)
                [job] = self.cluster.run("squeue", "-h", "-o", "%j %P %m %l").splitlines()
                self.assertRegex(job, rf"^webots_cloud_\S+_{simulation.port}_\S+ robots 100M 1:07:00$")
                self.assertIn("runs on node", simulation.log())
            self.cluster.wait_until_empty()
            simulation.wait_until_clean()

    async def test_a_simulator_that_crashes_ends_its_job(self):
        with cluster_server(self.cluster) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                [simulator] = [pid for step in self.cluster.steps() for pid in descendants(step)
                               if os.path.basename(os.readlink(f"/proc/{pid}/exe")) == "webots-demo-simulator"]
                os.kill(simulator, signal.SIGABRT)  # which sanitizers leave alone
                await browser.hear_all()
                self.assertEqual(browser.told[-1], "loading: Error: Webots has quit unexpectedly: it was ended by signal 6.")
            simulation.wait_until_clean()

    async def test_who_finds_the_cluster_full_hears_a_position_and_then_starts(self):
        with cluster_server(self.cluster) as simulation:
            async with contextlib.AsyncExitStack() as stack:
                first, second, third, fourth = [await stack.enter_async_context(Browser(simulation)) for _ in range(4)]
                await ready(first)
                await ready(second)
                await third.start()
                wait_until(lambda: len(self.cluster.jobs()) == 3, "the job is not there")
                await fourth.start()
                wait_until(lambda: json.loads(simulation.get("/load", {"Accept": "application/json"}))["load"] > 15, "the load stays low")  # a mean
                self.assertIn("position 1 of", await third.hear("loading: Waiting for a free node"))
                self.assertIn("position 2 of 2", await fourth.hear("loading: Waiting for a free node"))
                await fourth.socket.close()  # who leaves waits no longer
                wait_until(lambda: len(self.cluster.jobs()) == 3, "the job still waits")
                await first.socket.close()
                await third.hear("webots:")
                self.assertEqual(len([text for text in third.told if text.startswith("shutdownTimeout:")]), 2, third.told)
            simulation.wait_until_clean()

    async def test_a_job_that_slurm_does_not_start_is_a_sentence(self):
        overrides = [{"mode": "x3d", "memory": 999999}, {"mode": "w3d", "processors": 64}]
        with cluster_server(self.cluster, {"processors": 1, "overrides": overrides}) as simulation:
            async with Browser(simulation) as browser:
                await browser.start(mode="x3d")
                await browser.hear_all()
                self.assertIn("Slurm does not start the simulation: Requested node configuration is not available.", browser.told[-1])
            async with Browser(simulation) as browser:
                await browser.start(mode="w3d")
                self.assertIn("Slurm's reason: PartitionConfig.", await browser.hear("loading: Waiting for a free node"))
            async with Browser(simulation) as browser:
                await ready(browser)
            simulation.wait_until_clean()

    async def test_an_unknown_partition_is_told_at_the_start(self):
        with self.assertRaisesRegex(AssertionError, 'Slurm has no partition "nowhere"'):
            with cluster_server(self.cluster, {"partition": "nowhere"}):
                pass


class AnotherUser(OneCluster):
    async def check(self, **settings):
        with OwnedServer(user=NOBODY, **jobs_of(self.cluster), **settings) as simulation:
            async with Browser(simulation) as browser:
                address = await ready(browser)
                await see_a_picture(address)
                self.assertEqual(self.cluster.run("squeue", "-h", "-o", "%U").split(), [str(NOBODY)])
            self.cluster.wait_until_empty()
            simulation.wait_until_clean()

    async def test_a_server_that_is_not_root(self):
        await self.check()

    async def test_a_simulation_in_a_sandbox_with_a_network_of_its_own(self):
        await self.check(sandbox="bubblewrap", network="none")


class LostServers(OneCluster):
    async def test_a_killed_server_leaves_no_job(self):
        with cluster_server(self.cluster) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                simulation.process.kill()
                simulation.process.wait()
            self.cluster.wait_until_empty()
            simulation.start()
            async with Browser(simulation) as browser:
                await ready(browser)
            simulation.wait_until_clean()

    async def test_jobs_of_an_earlier_run_are_ended_at_the_start(self):
        with cluster_server(self.cluster) as simulation:
            simulation.stop()
            name = f"webots_cloud_{socket.gethostname().split('.')[0]}_{simulation.port}_"
            environment = {**os.environ, **self.cluster.environment}
            old, other = [subprocess.Popen(["srun", f"--job-name={job}", "sleep", "1000"], env=environment, stderr=subprocess.DEVNULL)
                          for job in (name + "0a1b_1_1", "somebody_elses")]
            try:
                wait_until(lambda: self.cluster.run("squeue", "-h", "-t", "R", "-o", "%j").count("\n") == 2, self.cluster.log)
                simulation.start()
                old.wait(PATIENCE)
                wait_until(lambda: self.cluster.jobs() == ["somebody_elses"], self.cluster.log)
            finally:
                end(old)
                end(other)


if __name__ == "__main__":
    main()
