#!/usr/bin/python3
"""Strangers beside each other in containers of a real Docker daemon that has Docker's own bridges and rules: what an editor reaches of
another's simulation, what is published where, and what builds reach of the machine's network, the metadata service of a cloud first of all.

Runs in a network namespace of its own, at the end of a cable with machines that are public and private.
"""

import asyncio
import contextlib
import json
import os
import socket
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.browser_client import Browser  # noqa: E402
from support.docker import IMAGES, DockerDaemon, compose_command, docker_server, python_files  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.processes import end_with_parent  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import main, program, wait_until  # noqa: E402

EDITOR = "benjamindeleze/theia-test:test3"
# Stands in for the editor, which listens on this port of its container.
LISTEN = "import socket\nlistener = socket.create_server(('', 3000))\nwhile True:\n    listener.accept()[0].close()"
METADATA_IPV6 = "fd00:ec2::254"
ANSWER = f"""import socket
listener = socket.create_server(("{METADATA_IPV6}", 80), family=socket.AF_INET6)
print("listens", flush=True)
while True:
    listener.accept()[0].close()"""
CONNECT = "exec 3<>/dev/tcp/{}/{} && echo open"
LISTENING = 8999
TARGETS = ("own", "gateway", "private", "metadata", "metadata_ipv6", "public")


def setUpModule():
    global docker, git
    stack = contextlib.ExitStack()
    unittest.addModuleCleanup(stack.close)
    simulator = program("webots-demo-simulator")
    compose_command()
    outside = stack.enter_context(own_network.Outside())
    answer_on_ipv6(stack, outside.process.pid)
    git = stack.enter_context(GitServer())
    docker = stack.enter_context(DockerDaemon(bridges=True))
    programs = ["/bin/sh", "/bin/sleep", "/bin/bash", "/usr/bin/timeout"]
    docker.import_image(f"{IMAGES}:R2025a-ubuntu22.04", {"/usr/local/webots/webots": simulator}, programs)
    docker.import_image(EDITOR, {}, [*programs, *python_files("socket")], ["/usr/bin/python3", "-c", LISTEN])
    robots = demo_project()
    del robots["webots.yml"]
    git.add_repository("o", "editors", {**robots, "webots.yml": "dockerCompose:theia:webots-project/controllers/\n"})
    git.add_repository("o", "curious", {**robots, "Dockerfile": curious()})


def answer_on_ipv6(stack, far):
    """Gives the other machines the second address of metadata services, which this machine has a route to."""
    for command in (f"nsenter -t {far} -n ip -6 address add fd00:78::2/64 dev far nodad",
                    f"nsenter -t {far} -n ip -6 address add {METADATA_IPV6}/128 dev far nodad",
                    "ip -6 address add fd00:78::1/64 dev cable nodad", f"ip -6 route add {METADATA_IPV6} via fd00:78::2"):
        subprocess.run(command.split(), check=True)
    answers = subprocess.Popen(["nsenter", "-t", str(far), "-n", sys.executable, "-c", ANSWER], stdout=subprocess.PIPE,
                               preexec_fn=end_with_parent)
    stack.callback(answers.wait)
    stack.callback(answers.kill)
    answers.stdout.readline()
    socket.create_connection((METADATA_IPV6, 80), 10).close()


def curious():
    """A Dockerfile that says what its build reaches."""
    addresses = {"own": (own_network.OWN, LISTENING), "gateway": ("172.17.0.1", LISTENING), "private": (own_network.PRIVATE, 80),
                 "metadata": (own_network.METADATA, 80), "metadata_ipv6": (METADATA_IPV6, 80), "public": (own_network.PUBLIC, 80)}
    lines = [f"FROM {IMAGES}:R2025a-ubuntu22.04"]
    for name, address in addresses.items():
        lines.append(f"RUN timeout 3 bash -c '{CONNECT.format(*address)}' && echo reaches {name}, || echo does not reach {name},")
    return "\n".join([*lines, "COPY . /usr/local/webots-project"]) + "\n"


class Neighbours(unittest.IsolatedAsyncioTestCase):
    def server(self, **settings):
        return self.enterContext(docker_server(docker, git, display="none", **settings))

    def world(self, repository):
        return f"{git.url}/o/{repository}/blob/main/worlds/arena.wbt"

    def reaches(self, container, address, port):
        return docker.attempt("exec", "--workdir", "/", container, "timeout", "3", "bash", "-c", CONNECT.format(address, port)).stdout == "open\n"

    def connects(self, address, port):
        try:
            socket.create_connection((address, port), 10).close()
        except OSError:
            return False
        return True

    def editors(self):
        """The editors' containers, and their addresses, the oldest first."""
        found = []
        for each in reversed(docker.run("ps", "--quiet", "--filter", "label=com.docker.compose.service=theia").split()):
            networks = json.loads(docker.run("inspect", each))[0]["NetworkSettings"]["Networks"].values()
            found.append((each, *((network["IPAddress"], network["Gateway"]) for network in networks)))
        return found

    async def look_at_editors(self, server, count, look):
        """Calls `look` with the editors of so many simulations."""
        async with contextlib.AsyncExitStack() as stack:
            for _ in range(count):
                browser = await stack.enter_async_context(Browser(server))
                await browser.start(self.world("editors"))
                await browser.hear("webots:")
            wait_until(lambda: len(self.editors()) == count, "there are not so many editors")
            await asyncio.to_thread(look, *self.editors())
        wait_until(lambda: docker.things()["containers"] == [], f"left: {docker.things()}\n{server.log()}", 90)
        server.wait_until_clean()

    async def test_no_editor_reaches_that_of_another_simulation(self):
        server = self.server(gateway=True)

        def look(ours, theirs):
            container, (address, gateway) = ours
            stranger, their_gateway = theirs[1]
            port = server.port + 502
            wait_until(lambda: self.connects("127.0.0.1", port), "the other editor is not published")
            wait_until(lambda: self.reaches(container, address, 3000), "our own editor does not listen")
            self.assertTrue(self.reaches(container, own_network.PUBLIC, 80), "it has no network")
            for target in ((stranger, 3000), (gateway, port), (their_gateway, port), (own_network.OWN, port), ("127.0.0.1", port)):
                self.assertFalse(self.reaches(container, *target), target)
            for other in (own_network.OWN, "::1", "fd00:78::1"):
                self.assertFalse(self.connects(other, port), other)
        await self.look_at_editors(server, 2, look)

    async def test_without_the_gateway_ports_are_open_on_addresses_of_both_kinds(self):
        server = self.server(gateway=False)

        def look(_editor):
            for address in ("127.0.0.1", own_network.OWN, "::1", "fd00:78::1"):
                wait_until(lambda: self.connects(address, server.port + 501), f"the editor is not published on {address}")
        await self.look_at_editors(server, 1, look)

    async def test_a_build_reaches_nothing_and_with_a_network_of_docker_the_metadata_service_too(self):
        self.enterContext(socket.create_server(("0.0.0.0", LISTENING), backlog=64))  # a service of the machine
        for settings, reached in (({}, set()), ({"buildNetwork": True}, {*TARGETS} - {"metadata_ipv6"})):
            with self.subTest(**settings):
                server = self.server(projectDockerfiles=True, **settings)
                async with Browser(server) as browser:
                    await browser.start(self.world("curious"))
                    await browser.hear("webots:")
                said = "\n".join(text for text in browser.told if " reach" in text and "Step" not in text)
                self.assertEqual({name for name in TARGETS if f"reaches {name}," in said}, reached, said)
                self.assertEqual({name for name in TARGETS if f"not reach {name}," in said}, {*TARGETS} - reached, said)
                wait_until(lambda: docker.things()["containers"] == [], f"left: {docker.things()}\n{server.log()}", 90)
                server.stop()


if __name__ == "__main__":
    own_network.enter()
    main()
