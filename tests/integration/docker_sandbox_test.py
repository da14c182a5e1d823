#!/usr/bin/python3
"""What a stranger's project can do in a container of a real Docker daemon: the contract of all sandboxes.

Runs in a network namespace of its own, at the end of a cable with an internet of two kinds of machines, public and private.
"""

import contextlib
import os
import socket
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import own_network  # noqa: E402
from support.docker import IMAGES, TEMPLATES, DockerDaemon, compose_command, python_files, xvfb_files  # noqa: E402
from support.sandbox_contract import Contract, named  # noqa: E402
from support.servers import descendants, main, program  # noqa: E402
from support.x_display import X_DISPLAY  # noqa: E402

PROJECT = "/usr/local/webots-project"  # in the container
X_SOCKETS = "/tmp/.X11-unix"


def setUpModule():
    global docker
    stack = contextlib.ExitStack()
    unittest.addModuleCleanup(stack.close)
    simulator = program("webots-demo-simulator")
    compose_command()
    stack.enter_context(own_network.Outside())
    docker = stack.enter_context(DockerDaemon())
    docker.import_image(f"{IMAGES}:R2025a-ubuntu22.04", {"/usr/local/webots/webots": simulator},
                        ["/bin/sh", "/bin/sleep", "/usr/bin/su", *xvfb_files(),
                         *python_files("ctypes", "encodings.idna", "json", "mmap", "subprocess", "socket", "termios")])


class Docker(Contract, unittest.TestCase):
    """With a display in each container, by the image's xvfb-run."""

    sandbox = "docker"
    description = "Docker, public internet only"
    needs = ("slirp4netns", "ip")
    display_key = "private"
    # System calls that are not in the list of seccomp.json are refused, and 32-bit ones end the program. Its terminal is the container's.
    expected = {"connect_public": ("done",), "type_into_terminal": ("private",), "call_with_32_bits": ("ended at once",),
                **dict.fromkeys(("open_vsock", "open_crypto_socket"), ("EPERM",))}

    @classmethod
    def make_server(cls):
        cls.keys = {**cls.keys, "docker": True, "dockerDir": TEMPLATES, "dockerImages": IMAGES, "display": cls.display_key,
                    "environment": {**docker.environment, "DISPLAY": ""}}
        return super().make_server()

    @classmethod
    async def attack(cls):
        await super().attack()
        cls.left = docker.things()

    @classmethod
    def watch(cls, neighbour_port, own_port):
        super().watch(neighbour_port, own_port)
        cls.displays = [cls.display_in(first) for first in cls.containers()]

    @staticmethod
    def display_in(first):
        """What the simulator of a container has for a display, and whether an X server lets in who has its password."""
        simulator, = [each for each in (first, *descendants(first)) if named(each) == "webots"]
        with open(f"/proc/{simulator}/environ") as environment:
            variables = dict(each.split("=", 1) for each in environment.read().split("\0") if each)
        found = {"display": variables["DISPLAY"], "sockets": os.listdir(f"/proc/{first}/root{X_SOCKETS}")}
        if "XAUTHORITY" in variables:
            script = X_DISPLAY + "address, key = own_display()\nprint(enter_display(address, key), enter_display(address, bytes(16)))"
            found["enters"] = docker.run("exec", "--workdir", "/", *[f"--env={name}={variables[name]}" for name in ("DISPLAY", "XAUTHORITY")],
                                         container_of(first), "/usr/bin/python3", "-c", script).strip()
        return found

    @classmethod
    def processes(cls):
        inside = cls.containers()
        return [*super().processes(), *inside, *[each for first in inside for each in descendants(first)]]

    @staticmethod
    def containers():
        """The first process of each, in the order in which they were started."""
        listed = docker.run("ps", "--quiet", "--filter", "label=com.docker.compose.service=webots").split()
        return [int(docker.run("inspect", "--format", "{{.State.Pid}}", each)) for each in reversed(listed)]

    @classmethod
    def project(cls):
        """As root sees it through the container's first process."""
        return f"/proc/{cls.containers()[-1]}/root{PROJECT}"

    def test_nothing_is_left_of_the_containers(self):
        self.assertEqual(self.left, {"containers": [], "networks": [], "volumes": []})

    def test_each_has_a_display_of_its_own(self):
        self.assertEqual(self.displays, 2 * [{"display": ":99", "sockets": ["X99"], "enters": "True False"}])


class DockerOnADisplay(Docker):
    """That of the machine, which it sees alone, and without a network."""

    variant = 'with `"network": "none"`'
    description = "Docker, no network"
    needs = ()
    keys = {"network": "none"}
    expected = {each: outcomes for each, outcomes in Docker.expected.items() if each != "connect_public"}

    @classmethod
    def listen(cls):
        super().listen()
        path = cls.display + "0"  # beside that of the contract
        shared = socket.socket(socket.AF_UNIX)
        cls.addClassCleanup(shared.close)
        shared.bind(path)
        cls.addClassCleanup(os.unlink, path)
        cls.shown = os.path.basename(path)
        cls.display_key = ":" + cls.shown[1:]

    def test_each_has_a_display_of_its_own(self):
        self.assertEqual(self.displays, 2 * [{"display": self.display_key, "sockets": [self.shown]}])


def container_of(first):
    """Docker's name for the container of a process."""
    with open(f"/proc/{first}/cgroup") as groups:
        return next(line.strip() for line in groups if "docker" in line).rpartition("/")[2].removeprefix("docker-").removesuffix(".scope")


if __name__ == "__main__":
    own_network.enter()
    main()
