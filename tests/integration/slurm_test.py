#!/usr/bin/python3
"""Simulations that are jobs of a real Slurm cluster: docs/clusters.md."""

import asyncio
import contextlib
import glob
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from limits_test import LimitedServer  # noqa: E402
from support.browser_client import Browser, server, websockets  # noqa: E402
from support.frames import PICTURE  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.lessons import solved  # noqa: E402
from support.processes import find_program  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.refusals import error_line, error_pattern  # noqa: E402
from support.servers import PATIENCE, descendants, end, is_alive, main, wait_until  # noqa: E402
from support.slurm import NODES, Cluster  # noqa: E402


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
        await asyncio.wait_for(viewer.recv(), PATIENCE)
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

    def simulators(self):
        """Those that run in jobs."""
        return [pid for step in self.cluster.steps() for pid in descendants(step)
                if os.path.basename(os.readlink(f"/proc/{pid}/exe")) == "webots-demo-simulator"]

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
                for text in (simulation.log(), simulation.get("/monitor")):  # which limits are Slurm's to keep
                    self.assertIn("not what its processes share, nor files in memory and the buffers of sockets", text)
            self.cluster.wait_until_empty()
            simulation.wait_until_clean()

    async def test_a_simulator_that_crashes_ends_its_job(self):
        with cluster_server(self.cluster) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                [simulator] = self.simulators()
                os.kill(simulator, signal.SIGABRT)  # which sanitizers leave alone
                await browser.hear_all()
                self.assertEqual(browser.told[-1], error_line("crashed", how="it was ended by signal 6"))
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
                said = ""
                while not re.search("Waiting for a free node|Error", said):
                    said = await browser.hear("loading: ")
                # Slurm 24 refuses at once what 22 lets wait.
                self.assertRegex(said, r"Slurm's reason: PartitionConfig\.|Requested node configuration is not available\.")
            async with Browser(simulation) as browser:
                await ready(browser)
            simulation.wait_until_clean()

    async def test_a_job_gets_the_graphics_processor_that_its_mode_needs(self):
        overrides = [{"mode": "w3d", "gres": "gpu:1"}]
        with cluster_server(self.cluster, {"overrides": overrides}) as simulation:
            async with contextlib.AsyncExitStack() as stack:
                with_it, other, without = [await stack.enter_async_context(Browser(simulation)) for _ in range(3)]
                await ready(with_it, mode="w3d")
                self.assertIn(self.cluster.run("squeue", "-h", "-o", "%b").split(), (["gres:gpu:1"], ["gres/gpu:1"]))  # of Slurm 22, of 24
                [simulator] = self.simulators()
                with open(f"/proc/{simulator}/environ") as environment:
                    self.assertIn("CUDA_VISIBLE_DEVICES=0", environment.read().split("\0"))
                await ready(other, mode="w3d")
                await without.start(mode="w3d")
                self.assertIn("position 1 of 1", await without.hear("loading: Waiting for a free node"))
                await with_it.socket.close()
                await without.hear("webots:")
            simulation.wait_until_clean()
        with cluster_server(self.cluster, {"gres": "gpu:2"}) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear_all()
                self.assertIn("Slurm does not start the simulation: Requested node configuration is not available.", browser.told[-1])

    async def test_the_monitor_shows_what_the_job_uses(self):
        with cluster_server(self.cluster) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                [simulator] = self.simulators()

                def row():
                    return json.loads(simulation.get("/monitor", {"Accept": "application/json"}))["simulations"][0]

                def memory():
                    with open(f"/proc/{simulator}/statm") as status:
                        return int(status.read().split()[1]) * os.sysconf("SC_PAGESIZE") / 1e6

                wait_until(lambda: memory() <= row().get("memory", 0) < 2 * memory() + 20, lambda: f"{row()}, but it has {memory()} MB")
                [world] = json.loads(simulation.get("/load", {"Accept": "application/json"}))["worlds"]
                self.assertGreater(world["memory"], 0.9 * memory() * 1e6)

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


SLOW_TAR = """#!/bin/sh
case "$*" in *--extract*) echo > "$0.began"; exec sleep 1000;; esac
exec /bin/tar "$@"
"""


class HiddenCluster(OneCluster):
    """Its nodes see nothing of the server's folders, and are left without copies."""

    @classmethod
    def setUpClass(cls):
        hidden = tempfile.mkdtemp(prefix="webots_cloud_hidden_", dir="/tmp")
        cls.addClassCleanup(shutil.rmtree, hidden, ignore_errors=True)
        os.chmod(hidden, 0o755)
        cls.hidden = hidden
        cls.cluster = cls.enterClassContext(Cluster(processors=cls.PROCESSORS, hidden=hidden))

    def settings(self, state="state", **slurm):
        os.makedirs(os.path.join(self.hidden, state), exist_ok=True)
        for node in NODES:
            os.chmod(self.cluster.seen_by(node, self.cluster.own_folder), 0o1777)
        return {**jobs_of(self.cluster, {"copyTo": self.cluster.own_folder, **slurm}), "stateDir": os.path.join(self.hidden, state)}

    def copies(self):
        return [folder for node in NODES
                for folder in glob.glob(self.cluster.seen_by(node, self.cluster.own_folder) + "/webots-cloud-job.*")]

    def tearDown(self):
        super().tearDown()
        wait_until(lambda: not self.copies(), lambda: f"left on the nodes: {self.copies()}")


class CopiedProjects(HiddenCluster):
    PROCESSORS = 2

    def copy(self, name):
        """A file of the only copy of a project."""
        [path] = [path for folder in self.copies() for path in glob.glob(f"{folder}/**/{name}", recursive=True)]
        return path

    async def test_a_browser_sees_a_simulation_whose_node_does_not_see_the_project(self):
        with server(**self.settings()) as simulation:
            async with Browser(simulation) as browser:
                address = await ready(browser)
                self.assertIn("loading: Copying the project to its node of the cluster (0.0 MB)", browser.told)
                await see_a_picture(address)
                self.assertTrue(os.path.isfile(self.copy("worlds/arena.wbt")))
                for node in NODES:
                    self.assertEqual(os.listdir(self.cluster.seen_by(node, self.hidden)), [], "the node sees the server's folder")
            simulation.wait_until_clean()

    async def test_without_a_copy_the_browser_is_told_what_is_wrong(self):
        with server(**{**self.settings(), **jobs_of(self.cluster)}) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear_all()
                self.assertIn("The node of the cluster does not see the simulation's project", browser.told[-1])

    async def test_a_sandbox_with_the_internet_for_the_copy(self):
        for program in ("bwrap", "slirp4netns"):
            if not find_program(program):
                self.skipTest(f"{program} is missing")
        if not os.path.exists("/dev/net/tun"):
            self.skipTest("slirp4netns needs /dev/net/tun")
        with server(sandbox="bubblewrap", network="internet", **self.settings()) as simulation:
            async with Browser(simulation) as browser:
                await see_a_picture(await ready(browser))
            simulation.wait_until_clean()

    async def test_a_file_is_put_back_into_the_copy(self):
        name = "avoid_walls/avoid_walls.py"
        with server(**self.settings()) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                path = self.copy(f"controllers/{name}")
                with open(path) as file:
                    original = file.read()
                with open(path, "w") as file:
                    file.write("changed")
                await browser.socket.send(json.dumps({"reset controller": name}))
                await browser.hear(f"reset controller: {name}")
                with open(path) as file:
                    self.assertEqual(file.read(), original)
                # What a simulation has put in its place is not followed.
                folder = os.path.dirname(path)
                os.rename(folder, folder + ".old")
                os.symlink("/tmp", folder)
                await browser.socket.send(json.dumps({"reset controller": name}))
                self.assertIn("can't be brought to where the simulation runs", await browser.hear("loading: Error:"))

    async def test_a_program_that_a_visitor_saves_runs_on_the_node_after_a_reset(self):
        file = "move/move.py"
        with server(**self.settings(), allowEdit=True) as simulation:
            async with Browser(simulation) as browser:
                address = await ready(browser, url="local:/demo_projects/lessons/blob/main/worlds/lesson_1_move.wbt", mode="w3d", edit=True)
                self.assertEqual(json.loads((await browser.hear("files: "))[len("files: "):])[0]["path"], file)
                async with websockets.connect(address + "/", max_size=None) as view:
                    await view.send("w3d;broadcast")
                    await view.send("fast:-1")
                    for program, printed in (("print('mine')\n", "stdout:mine"), (solved("lesson_1_move"), "stdout:You did it: ")):
                        await browser.socket.send(json.dumps({"write": {"path": file, "text": program}}))
                        self.assertEqual(json.loads((await browser.hear("file: "))[len("file: "):]), {"path": file, "saved": True})
                        with open(self.copy(f"controllers/{file}")) as copy:
                            self.assertEqual(copy.read(), program)
                        await view.send("reset")
                        while not str(await asyncio.wait_for(view.recv(), PATIENCE)).startswith(printed):
                            pass
            simulation.wait_until_clean()

    async def test_who_leaves_while_the_project_is_copied_leaves_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            tar = os.path.join(folder, "tar")
            with open(tar, "w") as file:
                file.write(SLOW_TAR)
            os.chmod(tar, 0o755)
            settings = self.settings()
            settings["environment"]["PATH"] = f"{folder}:{os.environ['PATH']}"
            with server(**settings) as simulation:
                async with Browser(simulation) as browser:
                    await browser.start()
                    await browser.hear("loading: Copying the project")
                    wait_until(lambda: os.path.exists(tar + ".began"), "nothing is copied")
                    self.assertTrue(self.copies())
                simulation.wait_until_clean()

    async def test_a_node_without_room_is_a_sentence(self):
        settings = self.settings("full")
        files = demo_project()
        files["worlds/large.bin"] = os.urandom(40 << 20)
        with tempfile.TemporaryDirectory() as folder:
            for name, content in files.items():
                path = os.path.join(folder, "projects", "large", name)
                os.makedirs(os.path.dirname(path), exist_ok=True)
                with open(path, "wb") as file:
                    file.write(content)
            settings.update(forges=[{"url": "local:", "directory": folder}], allowedRepositories=["local:/projects"])
            with server(**settings) as simulation:
                async with Browser(simulation) as browser:
                    await browser.start("local:/projects/large/blob/main/worlds/arena.wbt")
                    await browser.hear_all()
                    self.assertRegex(browser.told[-1], error_pattern("job_project_not_copied_saying"))
                    words = re.match(error_pattern("job_project_not_copied_saying"), browser.told[-1])["words"]
                    self.assertRegex(words, r"^(No space left on device|Wrote only \d+ of \d+ bytes)$")

    async def test_what_a_killed_guard_leaves_goes_with_the_next_job(self):
        with server(**self.settings()) as simulation:
            async with Browser(simulation) as browser:
                await ready(browser)
                [guard] = [pid for step in self.cluster.steps() for pid in descendants(step)[:1]]
                os.kill(guard, signal.SIGKILL)
                await browser.hear_all()
            self.cluster.wait_until_empty()
            [left] = self.copies()
            node = next(node for node in NODES if left.startswith(self.cluster.seen_by(node, "")))
            other = next(each for each in NODES if each != node)
            self.cluster.run("scontrol", "update", f"nodename={other}", "state=drain", "reason=test")
            try:
                async with Browser(simulation) as browser:
                    await ready(browser)
                    self.assertFalse(os.path.exists(left))
            finally:
                self.cluster.run("scontrol", "update", f"nodename={other}", "state=resume")
            simulation.wait_until_clean()

    async def test_a_job_that_takes_more_than_it_may_is_a_sentence(self):
        limits = {"disk": error_line("disk_overrun", max=10), "memory": error_line("job_memory_overrun", max=200)}
        with LimitedServer(**self.settings("limited", memory=200)) as simulation:
            for name, told in limits.items():
                async with Browser(simulation) as browser:
                    await browser.start(f"local:/projects/{name}/blob/main/worlds/hostile.wbt")
                    await browser.hear_all()
                    self.assertEqual(browser.told[-1], told)
            simulation.wait_until_clean()


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
