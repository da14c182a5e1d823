#!/usr/bin/python3
"""What takes longer than slurm_test.py: nodes and slurmctld that fail, jobs that Slurm ends, many at once, and many in a row.

    WEBOTS_CLOUD_BIN=build/release/bin tests/integration/slurm_endurance.py [--cycles NUMBER] [unittest's options]
"""

import asyncio
import os
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from slurm_test import HiddenCluster, cluster_server, ready, see_a_picture  # noqa: E402
from support.browser_client import Browser, server  # noqa: E402
from support.processes import end_with_parent  # noqa: E402
from support.servers import PATIENCE, end, main, wait_until  # noqa: E402
from support.slurm import NODES, Cluster  # noqa: E402

AT_ONCE = 4  # of those in a row

cycles = 1000


class Endurance(unittest.IsolatedAsyncioTestCase):
    def cluster(self, **settings):
        return self.enterContext(Cluster(**settings))

    def nothing_is_left(self, cluster, simulation):
        simulation.wait_until_clean()
        cluster.wait_until_empty()
        wait_until(lambda: not cluster.steps(), "something of a job is left on a node")

    async def test_a_job_out_of_time_is_a_sentence(self):
        cluster = self.cluster()
        with cluster_server(cluster, {"timeLimit": 60}) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                await browser.hear_all()
                self.assertEqual(browser.told[-1], "loading: Error: The simulation was ended by Slurm: its job has reached its time limit.")
            self.nothing_is_left(cluster, simulation)

    async def test_a_preempted_job_is_a_sentence(self):
        cluster = self.cluster(processors=1)
        with cluster_server(cluster) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                urgent = subprocess.Popen(["srun", "--partition=urgent", "--nodes=2", "--ntasks=2", "sleep", "1000"], stderr=subprocess.DEVNULL,
                                          env={**os.environ, **cluster.environment}, preexec_fn=end_with_parent)
                try:
                    await browser.hear_all()
                finally:
                    end(urgent)
                self.assertEqual(browser.told[-1],
                                 "loading: Error: The simulation was ended by Slurm, which needs its node for a more important job.")
            self.nothing_is_left(cluster, simulation)

    async def test_a_job_that_an_operator_cancels_is_a_sentence(self):
        cluster = self.cluster()
        with cluster_server(cluster) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                cluster.run("scancel", "--user=root")
                await browser.hear_all()
                self.assertEqual(browser.told[-1], "loading: Error: The simulation was ended: its job was cancelled.")
            self.nothing_is_left(cluster, simulation)

    async def test_a_node_that_fails_is_a_sentence_and_others_go_on(self):
        cluster = self.cluster(processors=1, node_timeout=10)
        with cluster_server(cluster) as simulation:
            async with Browser(simulation) as first, Browser(simulation) as second:
                await ready(first)
                address = await ready(second)
                cluster.stop_node(NODES[0])  # the nodes are filled in their order
                await first.hear_all()
                self.assertEqual(first.told[-1], "loading: Error: The simulation has ended: its node of the cluster has failed.")
                await see_a_picture(address)
            cluster.start_node(NODES[0])
            wait_until(lambda: cluster.run("sinfo", "-h", "-n", NODES[0], "-p", "robots", "-o", "%T").split() == ["idle"], cluster.log)
            async with Browser(simulation) as browser:
                await ready(browser)
            self.nothing_is_left(cluster, simulation)

    async def test_while_slurmctld_is_away_for_a_minute_simulations_go_on(self):
        cluster = self.cluster(processors=1)
        with cluster_server(cluster) as simulation:
            async with Browser(simulation) as stays, Browser(simulation) as leaves, Browser(simulation) as waits:
                address = await ready(stays)
                await ready(leaves)
                await waits.start()
                await waits.hear("loading: Waiting for a free node of the cluster: position 1 of 1.")
                cluster.stop_controller()
                away = time.monotonic()
                await waits.hear("loading: Waiting for a free node of the cluster, whose scheduler does not answer")
                await leaves.socket.close()
                while time.monotonic() - away < 60:
                    await see_a_picture(address)
                cluster.start_controller()
                await waits.hear("webots:")
                await see_a_picture(address)
            self.nothing_is_left(cluster, simulation)

    async def test_thirty_two_at_once(self):
        cluster = self.cluster(processors=16)
        with cluster_server(cluster, maxConnections=40, simulationsPerAddress=0) as simulation:
            browsers = [Browser(simulation) for _ in range(32)]
            for browser in browsers:
                await browser.__aenter__()
            began = time.monotonic()
            addresses = await asyncio.gather(*(ready(browser) for browser in browsers))
            print(f"32 ready after {time.monotonic() - began:.1f} s", file=sys.stderr)
            self.assertEqual(len(set(addresses)), 32)
            self.assertEqual(len(cluster.jobs()), 32)
            for browser in browsers:
                await browser.__aexit__()
            self.nothing_is_left(cluster, simulation)

    async def test_many_in_a_row_leave_no_job(self):
        cluster = self.cluster(processors=AT_ONCE)
        with cluster_server(cluster) as simulation:
            await many_in_a_row(simulation)
            self.nothing_is_left(cluster, simulation)


class EnduranceOfCopies(HiddenCluster):
    PROCESSORS = AT_ONCE

    async def test_many_in_a_row_leave_neither_job_nor_copy(self):
        with server(**self.settings()) as simulation:
            await many_in_a_row(simulation)
            simulation.wait_until_clean()


async def many_in_a_row(simulation):
    began = time.monotonic()

    async def some(number):
        for _ in range(number):
            async with Browser(simulation) as browser:
                await ready(browser)

    await asyncio.wait_for(asyncio.gather(*(some(cycles // AT_ONCE) for _ in range(AT_ONCE))), cycles * PATIENCE)
    print(f"{cycles // AT_ONCE * AT_ONCE} simulations in {time.monotonic() - began:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    if "--cycles" in sys.argv:
        at = sys.argv.index("--cycles")
        cycles = int(sys.argv[at + 1])
        del sys.argv[at:at + 2]
    main()
