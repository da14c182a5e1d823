#!/usr/bin/python3
"""The pods of config/kubernetes/base as containers of a real Docker daemon: two session servers and three simulation servers, which they find
by name, under load. One of these drains meanwhile and is replaced, as the pods of a Deployment are; then a session server. No simulation may be
lost. And those of config/kubernetes/sandboxed, with a simulation.

WEBOTS_CLOUD_BIN=build/release/bin tests/container_site.py

As root, with dockerd, debootstrap, dnsmasq, kubectl, python3-kubernetes, and our packages made: cmake --build --preset release
--target installable && cpack --preset release. Making the images takes three minutes and Debian's mirror, the site one minute and a network namespace.
"""

import argparse
import asyncio
import contextlib
import json
import os
import random
import secrets
import signal
import ssl
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from support import own_network  # noqa: E402
from support.browser_client import WORLD, websockets  # noqa: E402
from support.certificates import self_signed  # noqa: E402
from support.docker import DockerDaemon, require_docker  # noqa: E402
from support.kubernetes_documents import documents  # noqa: E402
from support.pods import SUBNET, Cluster  # noqa: E402
from support.processes import end_with_parent, required_program  # noqa: E402
from support.servers import BIN, end, main, wait_until  # noqa: E402
from support.waiting import PATIENCE  # noqa: E402

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
BASE = "webots-cloud/debian:bookworm"
TAG = "site"
NAME = "sim.example.org"  # of base/session.json
SERVICE = "simulation.webots.svc.cluster.local"
STAYERS = 6  # people who stay over all that happens
COMERS = 3  # people who come and go


def make_images(path):
    """Builds the images with a daemon of its own, where packages can be fetched."""
    with DockerDaemon() as docker:
        done = subprocess.run([os.path.join(ROOT, "config/containers/build.sh"), "--bootstrap", "--base", BASE, "--network", "host", "--tag", TAG,
                               "--packages", os.path.join(os.path.dirname(BIN), "packages"), "--sbom", os.path.dirname(path)],
                              env={**os.environ, **docker.environment}, stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            raise SystemExit("The images could not be made.")
        docker.run("save", "--output", path, *[f"webots-cloud/{each}:{TAG}" for each in ("session-server", "simulation-server")])


class Names:
    """The name server of a cluster: the name of a headless service stands for the addresses of its pods."""

    def __init__(self, folder):
        self.path = os.path.join(folder, "hosts")
        self.know([])
        self.process = subprocess.Popen([required_program("dnsmasq", "dnsmasq-base"), "--keep-in-foreground", "--conf-file=/dev/null", "--no-resolv",
                                         "--no-hosts", f"--addn-hosts={self.path}", "--local=/cluster.local/", "--local-ttl=2", "--user=root",
                                         "--bind-interfaces", f"--listen-address={SUBNET}.1", "--pid-file="], stdin=subprocess.DEVNULL,
                                        preexec_fn=end_with_parent)

    def know(self, addresses):
        with open(self.path, "w") as file:
            file.writelines(f"{address} {SERVICE}\n" for address in addresses)

    def read_again(self):
        self.process.send_signal(signal.SIGHUP)

    def close(self):
        end(self.process)


class Site:
    """The two session servers and three simulation servers of a folder of config/kubernetes. Others may come and take their place."""

    def __init__(self, stack, name):
        docker = stack.enter_context(DockerDaemon())
        docker.run("load", "--input", options.images)
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="webots_cloud_site_"))
        tls = {name: self.certificate(os.path.join(folder, name), f"DNS:{name}") for name in (NAME, SERVICE)}
        self.trust = ssl.create_default_context(cadata=tls[NAME]["tls.crt"])
        self.cluster = Cluster(docker, documents(name), {"session-secret": {"word": secrets.token_hex(32)}, "tls": tls[NAME],
                                                           "machines": tls[SERVICE]}, TAG, self.configuration, f"{SUBNET}.1")
        stack.callback(self.cluster.close)
        self.names = Names(folder)
        stack.callback(self.names.close)
        self.simulation = [self.cluster.start("simulation") for _ in range(3)]
        self.session = [self.cluster.start("session") for _ in range(2)]
        self.tell_names()
        for pod in [*self.simulation, *self.session]:
            pod.wait_until_ready()
        for pod in self.session:
            self.wait_for_machines(pod)

    @staticmethod
    def certificate(folder, name):
        """What a secret of the type tls has."""
        os.mkdir(folder)
        found = {}
        for file, path in zip(("tls.crt", "tls.key"), self_signed(folder, name)):
            with open(path) as text:
                found[file] = text.read()
        return found

    @staticmethod
    def configuration(text):
        config = json.loads(text)
        if "simulationServers" in config:
            config["loadRefresh"] = 1
            config["loadThreshold"] = 1000  # the load is that of this machine, which may have other work
            config["sessionBurst"] = 0  # everybody comes from one address
        return json.dumps(config, indent=2)

    def tell_names(self):
        """Of pods that drain as well, until they have gone: the service has "publishNotReadyAddresses"."""
        self.names.know([pod.address for pod in self.simulation])
        self.names.read_again()

    def add(self):
        """One more simulation server, as the Deployment starts it in place of one that drains."""
        new = self.cluster.start("simulation")
        self.simulation.append(new)
        self.tell_names()
        new.wait_until_ready()
        return new

    def remove(self, pod):
        """It has ended."""
        self.simulation.remove(pod)
        self.tell_names()

    def shown(self, session):
        """The machines that a session server knows, as its monitor page shows them, by their addresses."""
        return {each["address"].partition(":")[0]: each for each in json.loads(session.ask("/monitor", Accept="application/json")[1])["servers"]}

    def wait_for_machines(self, session):
        """Until it reaches all that there are, and knows no others."""
        def are_there():
            shown = self.shown(session)
            return shown.keys() == {pod.address for pod in self.simulation} and all(each["load"] is not None for each in shown.values())

        wait_until(are_there, lambda: f"it finds the machines: {self.shown(session)}\n{session.log()}")


class Person:
    """Somebody with the viewer, at one of the session servers."""

    def __init__(self, site):
        self.site = site
        self.messages = 0
        self.news = asyncio.Event()
        self.entrance = None

    async def connect(self, url):
        return await websockets.connect(url, host=self.entrance.address, port=443, ssl=self.site.trust, server_hostname=NAME,
                                        open_timeout=PATIENCE, ping_interval=None)

    async def hear(self, beginning):
        async def listen():
            while True:
                text = await self.client.recv()
                if text.startswith("loading: Error"):
                    raise AssertionError(text)
                if text.startswith(beginning):
                    return text

        return await asyncio.wait_for(listen(), PATIENCE)

    async def come(self, **message):
        self.entrance = random.choice(self.site.session)
        self.client = await self.connect(f"wss://{NAME}/client")
        await self.client.send(json.dumps(message or {"start": {"url": WORLD, "mode": "x3d", "reconnect": True}}))
        self.address = (await self.hear("webots:")).removeprefix("webots:")
        self.token = (await self.hear("reconnectToken: ")).removeprefix("reconnectToken: ")
        self.viewer = await self.connect(f"{self.address}/")
        await self.viewer.send("x3d")
        await self.viewer.send("real-time:-1")
        self.listening = asyncio.gather(self.listen(self.client), self.watch(self.viewer))

    @staticmethod
    async def listen(client):
        """Who does not listen answers no pings any more."""
        with contextlib.suppress(websockets.ConnectionClosed):
            while True:
                await client.recv()

    async def watch(self, viewer):
        with contextlib.suppress(websockets.ConnectionClosed):
            while True:
                await viewer.recv()
                self.messages += 1
                self.news.set()
        self.news.set()

    async def look(self, count):
        """Waits for so many messages more; fails where the simulation ends."""
        wanted = self.messages + count

        async def wait():
            while self.messages < wanted and not self.viewer.closed:
                self.news.clear()
                await self.news.wait()

        await asyncio.wait_for(wait(), PATIENCE)
        if self.viewer.closed:
            logs = [log for pod in [*self.site.session, *self.site.simulation] for log in (pod.name, *pod.log().splitlines()[-10:])]
            raise AssertionError("\n".join([f"a simulation was lost, {self.address}: {self.viewer.close_code}", *logs]))

    async def lose(self):
        """The network fails."""
        for socket in (self.client, self.viewer):
            socket.transport.abort()
        await self.listening

    async def leave(self):
        if self.viewer.closed or self.client.closed:
            raise AssertionError("a simulation was lost")
        await self.viewer.close()
        await self.client.close()


class UnderLoad(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        stack = contextlib.ExitStack()
        self.addCleanup(stack.close)
        self.site = Site(stack, "base")

    async def asyncSetUp(self):
        asyncio.get_running_loop().set_debug(False)  # unittest's choice, which takes half of the processor here
        self.stayers = [Person(self.site) for _ in range(STAYERS)]
        for person in self.stayers:
            await person.come()
            await person.look(1)
        self.are_leaving = False
        self.visits = 0
        self.comers = [asyncio.create_task(self.come_and_go()) for _ in range(COMERS)]

    async def come_and_go(self):
        while not self.are_leaving:
            person = Person(self.site)
            await person.come()
            await person.look(10)
            await person.leave()
            self.visits += 1

    async def until(self, condition, what):
        await asyncio.to_thread(wait_until, condition, what)

    async def all_look(self, persons):
        await asyncio.gather(*(person.look(20) for person in persons))

    async def test_a_machine_and_a_session_server_are_replaced_and_no_simulation_is_lost(self):
        site = self.site
        victim = max(site.simulation, key=lambda pod: len(self.staying(pod)))
        staying = self.staying(victim)

        # A machine is to go, and another one comes at once: people come and go elsewhere, and the simulations that it has go on.
        ended = victim.end()
        await self.until(lambda: victim.ask("/readyz") == (503, "draining"), lambda: f"it drains:\n{victim.log()}")
        new = await asyncio.to_thread(site.add)
        await self.until(lambda: victim.metric("webots_simulations") == len(staying), "who came and went has gone")
        before = self.visits
        await self.until(lambda: self.visits >= before + 20, "people come and go")
        await self.until(lambda: new.metric("webots_starts_total") > 0, lambda: f"people come to the new machine:\n{site.session[0].log()}")
        await self.all_look(self.stayers)
        self.assertEqual(victim.state()[0], "running")
        self.assertEqual(victim.metric("webots_simulations"), len(staying), "only who was there is still there")

        # Who loses the connection to a simulation there finds it again.
        for person in staying:
            address = person.address
            await person.lose()
            await person.come(reconnect=person.token)
            self.assertEqual(person.address, address)
        await self.all_look(staying)

        # They leave: the machine ends by itself, and is forgotten.
        for person in staying:
            await person.leave()
        await self.until(lambda: not ended.is_alive(), lambda: f"it ends with its last simulation:\n{victim.log()}")
        self.assertEqual(victim.state(), ("exited", 0), victim.log())
        self.assertFalse(victim.was_stopped, "nobody had to end it")
        site.remove(victim)
        for session in site.session:
            await asyncio.to_thread(site.wait_for_machines, session)

        # A session server goes: whoever is connected through it returns through the other one, to the same simulation.
        self.are_leaving = True
        await asyncio.gather(*self.comers)
        stayers = [person for person in self.stayers if person not in staying]
        old = stayers[0].entrance
        moved = [person for person in stayers if person.entrance is old]
        site.session.remove(old)
        ended = old.end()
        for person in moved:
            await person.client.wait_closed()
            address = person.address
            await person.come(reconnect=person.token)
            self.assertEqual(person.address, address)
        await self.all_look(stayers)
        await self.until(lambda: not ended.is_alive(), "the session server ends")
        self.assertEqual(old.state(), ("exited", 0), old.log())
        for person in stayers:
            await person.leave()
        await self.until(lambda: not any(pod.metric("webots_simulations") for pod in site.simulation), "all simulations have ended")
        print(f"{self.visits} people came and went, {len(self.stayers)} stayed, {len(staying)} of them on the machine that drained; "
              f"{len(moved)} returned through the other session server; {sum(person.messages for person in self.stayers)} messages of simulations")

    def staying(self, pod):
        path = self.site.shown(self.site.session[0])[pod.address]["path"]
        return [person for person in self.stayers if f"{path}/" in person.address]

    async def asyncTearDown(self):
        self.are_leaving = True
        for task in self.comers:
            task.cancel()
        for outcome in await asyncio.gather(*self.comers, return_exceptions=True):
            if isinstance(outcome, Exception) and not isinstance(outcome, asyncio.CancelledError):
                raise outcome


class Sandboxed(unittest.IsolatedAsyncioTestCase):
    async def test_simulations_run_in_bubblewrap(self):
        stack = contextlib.ExitStack()
        self.addCleanup(stack.close)
        site = await asyncio.to_thread(Site, stack, "sandboxed")
        for pod in site.simulation:
            self.assertIn("Simulations run in a sandbox: bubblewrap, no network.", pod.log())
            self.assertEqual(pod.metric("webots_simulations_isolated"), 1)
        person = Person(site)
        await person.come()
        await person.look(20)
        await person.leave()


def with_images(path):
    """Runs this script again in a network namespace, where it finds the images; returns its exit status."""
    if not os.path.exists(path):
        make_images(path)
    return subprocess.run(["unshare", "-nm", "--propagation", "private", sys.executable, *sys.argv, "--images", path],
                          env={**os.environ, own_network.MARK: "1"}).returncode


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--images", metavar="FILE", help="keep the images there, and do not make them where there are some; else made anew")
    options, unittest_arguments = parser.parse_known_args()
    try:
        require_docker()
    except unittest.SkipTest as reason:
        sys.exit(print(f"skipped: {reason}") or 77)
    if os.environ.get(own_network.MARK):
        own_network.enter()
        sys.argv[1:] = unittest_arguments
        main()
    elif options.images:
        sys.exit(with_images(os.path.abspath(options.images)))
    else:
        with tempfile.TemporaryDirectory(prefix="webots_cloud_images_") as folder_of_images:
            sys.exit(with_images(os.path.join(folder_of_images, "images.tar")))
