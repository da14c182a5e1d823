#!/usr/bin/python3
"""What a build may do in an engine whose operator has set what docs/docker.md advises for it ("What a build may do"), and in one as Debian
installs it: Docker has no such options for a single build.
"""

import contextlib
import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser  # noqa: E402
from support.docker import IMAGES, TEMPLATES, DockerDaemon, compose_command, docker_server, python_files  # noqa: E402
from support.git_server import GitServer  # noqa: E402
from support.projects import demo_project  # noqa: E402
from support.servers import main, program, wait_until  # noqa: E402

WARNING = "Builds of projects may use Docker's own list of system calls"
# Each says whether it could; what packages need is last.
ATTEMPTS = r"""import ctypes, os, socket, stat
def attempt(name, function):
    try:
        function()
        print(name, 'could,')
    except OSError as error:
        print(name, 'could not,', error)
def gain():
    with open('/proc/self/status') as status:
        if 'NoNewPrivs:\t1' in status.read():
            raise OSError('no new privileges')
def change_owner():
    open('/owned', 'w').close()
    os.chown('/owned', 7, 7)
    if os.fork() == 0:
        os.setgid(7)
        os.setuid(7)
        os._exit(0 if os.getuid() == 7 else 1)
    if os.wait()[1]:
        raise OSError('can not become another user')
attempt('device', lambda: os.mknod('/disk', 0o600 | stat.S_IFBLK, os.makedev(8, 0)))
attempt('device-at', lambda: os.mknod('disk2', 0o600 | stat.S_IFCHR, os.makedev(1, 1), dir_fd=os.open('/', os.O_RDONLY)))
attempt('raw', lambda: socket.socket(socket.AF_INET, socket.SOCK_RAW, socket.IPPROTO_ICMP).close())
attempt('raw6', lambda: socket.socket(socket.AF_INET6, socket.SOCK_RAW | socket.SOCK_NONBLOCK, 58).close())
attempt('packet', lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW).close())
attempt('root', lambda: os.chroot('/'))
attempt('gain', gain)
attempt('pipe', lambda: os.mkfifo('/pipe'))
attempt('stream', lambda: socket.socket(socket.AF_INET, socket.SOCK_STREAM).close())
attempt('datagram', lambda: socket.socket(socket.AF_INET6, socket.SOCK_DGRAM).close())
attempt('owner', change_owner)
"""
REFUSED = ("device", "device-at", "raw", "raw6", "packet", "root", "gain")
NEEDED = ("pipe", "stream", "datagram", "owner")


class Builds(unittest.IsolatedAsyncioTestCase):
    async def what_it_could(self, *options):
        """The attempts that succeed in a build of an engine with these options, those that do not, and whether the server warns of it."""
        docker = self.enterContext(DockerDaemon(options=options))
        simulator = program("webots-demo-simulator")
        docker.import_image(f"{IMAGES}:R2025a-ubuntu22.04", {"/usr/local/webots/webots": simulator},
                            ["/bin/sh", "/bin/sleep", *python_files("ctypes", "socket")])
        with contextlib.ExitStack() as stack:
            git = stack.enter_context(GitServer())
            robots = demo_project()
            del robots["webots.yml"]
            dockerfile = f"FROM {IMAGES}:R2025a-ubuntu22.04\nCOPY . /usr/local/webots-project\n" \
                         "RUN /usr/bin/python3 /usr/local/webots-project/attempts.py\n"
            git.add_repository("o", "curious", {**robots, "attempts.py": ATTEMPTS, "Dockerfile": dockerfile})
            server = stack.enter_context(docker_server(docker, git, display="none", projectDockerfiles=True))
            async with Browser(server) as browser:
                await browser.start(f"{git.url}/o/curious/blob/main/worlds/arena.wbt")
                await browser.hear("webots:")
            wait_until(lambda: docker.things()["containers"] == [], lambda: f"left: {docker.things()}\n{server.log()}", 90)
            said = "\n".join(browser.told)
            could = {name for name in (*REFUSED, *NEEDED) if f"{name} could," in said}
            could_not = {name for name in (*REFUSED, *NEEDED) if f"{name} could not," in said}
            return could, could_not, WARNING in server.log()

    async def test_an_engine_as_it_is_lets_builds_do_what_docker_does_and_the_server_says_so(self):
        self.assertEqual(await self.what_it_could(), ({*REFUSED, *NEEDED}, set(), True))

    async def test_an_engine_with_our_list_and_no_new_privileges_lets_builds_do_what_packages_need(self):
        options = ("--no-new-privileges", f"--seccomp-profile={TEMPLATES}/seccomp.json")
        self.assertEqual(await self.what_it_could(*options), ({*NEEDED}, {*REFUSED}, False))


if __name__ == "__main__":
    main()
