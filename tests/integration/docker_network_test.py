#!/usr/bin/python3
"""What simulations in containers of a real Docker daemon reach: the key "network", which the server keeps for containers too.

Runs in a network namespace of its own, at the end of a cable with machines that are public and private.
"""

import asyncio
import contextlib
import json
import os
import socket
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.docker import IMAGES, DockerDaemon, compose_command, docker_server  # noqa: E402
from support.frames import Frames, running  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import main, port_is_free, program, wait_until  # noqa: E402

# Says "open" where somebody answers; bash, since the image has no Python.
CONNECT = 'exec 3<>/dev/tcp/{}/{} && echo open'


def setUpModule():
    global docker, git
    stack = contextlib.ExitStack()
    unittest.addModuleCleanup(stack.close)
    simulator = program("webots-demo-simulator")
    compose_command()
    stack.enter_context(own_network.Outside())
    git = stack.enter_context(GitServer())
    docker = stack.enter_context(DockerDaemon())
    docker.import_image(f"{IMAGES}:R2025a-ubuntu22.04", {"/usr/local/webots/webots": simulator},
                        ["/bin/sh", "/bin/sleep", "/bin/bash", "/usr/bin/timeout", "/bin/cat"])
    robots = demo_project()
    del robots["webots.yml"]
    git.add_repository("o", "robots", robots)


class Network(unittest.IsolatedAsyncioTestCase):
    def server(self, **settings):
        return self.enterContext(docker_server(docker, git, display="none", **settings))

    def reaches(self, container, address, port):
        said = docker.attempt("exec", "--workdir", "/", container, "/usr/bin/timeout", "3", "/bin/bash", "-c", CONNECT.format(address, port))
        return said.stdout == "open\n"

    async def check(self, server, reached):
        """Starts a simulation, and compares what it reaches."""
        loopback = self.enterContext(socket.create_server(("0.0.0.0", 0), backlog=64))
        port = loopback.getsockname()[1]
        async with Browser(server) as browser:
            await browser.start(f"{git.url}/o/robots/blob/main/worlds/arena.wbt")
            # Its own port, or, through the gateway, the server's and a path.
            own, _, path = (await browser.hear("webots:")).rpartition(":")[2].partition("/")
            own, path = int(own), f"/{path}/" if path else "/"
            self.assertEqual(port_is_free(server.port + 1), path != "/")
            container = docker.container_of("webots")
            async with running(own, path):
                await asyncio.to_thread(self.see_pictures, own, path + "mjpeg")
            addresses = {"loopback": ("127.0.0.1", port), "own": (own_network.OWN, port), "gateway": ("10.0.2.2", port),
                         "resolver": ("10.0.2.3", port), "private": (own_network.PRIVATE, 80), "shared": (own_network.SHARED, 80),
                         "metadata": (own_network.METADATA, 80), "public": (own_network.PUBLIC, 80)}
            if "public" in reached:
                wait_until(lambda: self.reaches(container, *addresses["public"]), "it has no network")
            found = {name for name, address in addresses.items() if self.reaches(container, *address)}
            self.assertEqual(found, reached)
        wait_until(lambda: docker.things()["containers"] == [], f"left: {docker.things()}\n{server.log()}", 90)
        server.wait_until_clean()

    @staticmethod
    def see_pictures(port, path):
        frames = Frames(port, path)
        frames.wait_for_next("of a simulation in a container")
        frames.close()

    async def test_the_public_internet_alone(self):
        server = self.server()
        self.assertIn("Docker, public internet only", server.get("/monitor"))
        await self.check(server, {"public"})

    async def test_no_other_container_takes_the_place_of_a_simulator(self):
        server = self.server(network="none", gateway=True)
        async with Browser(server) as browser:
            await browser.start(f"{git.url}/o/robots/blob/main/worlds/arena.wbt")
            own, _, path = (await browser.hear("webots:")).rpartition(":")[2].partition("/")
            container = docker.container_of("webots")
            labels = json.loads(docker.run("inspect", "--format", "{{json .Config.Labels}}", container))
            # All that an image can say of itself, if its maker has found out the names of the simulation.
            forged = [f"--label={key}={value}" for key, value in labels.items() if key != "webots_cloud.simulator"]
            async with running(int(own), f"/{path}/"):
                await asyncio.to_thread(self.watch_beside, forged, int(own), f"/{path}/mjpeg")
        wait_until(lambda: docker.things()["containers"] == [], f"left: {docker.things()}\n{server.log()}", 90)
        server.wait_until_clean()

    def watch_beside(self, forged, port, path):
        """Pictures come, to who was there before and to who comes, while such containers start."""
        before = Frames(port, path)
        before.wait_for_next("of a simulation in a container")
        for _ in range(3):
            docker.run("run", "--detach", "--network=none", *forged, f"{IMAGES}:R2025a-ubuntu22.04")
        self.see_pictures(port, path)
        before.wait_for_next("beside containers that look like its own")
        before.close()

    async def test_nothing(self):
        server = self.server(network="none", gateway=True)
        self.assertIn("Docker, no network", server.get("/monitor"))
        await self.check(server, set())


if __name__ == "__main__":
    own_network.enter()
    main()
