#!/usr/bin/python3
"""What the sandboxes of simulations cost: the tables of docs/performance.md. Each pair is measured in turns within one run.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/sandbox_bench.py [--sandbox bubblewrap|firejail|docker] [--rounds 40]

*Start*: until a program under the guard prints a line, with the very command line that the server has for a simulator, and without the sandbox.
*Simulation*: from the request of a browser until it is told the address of its simulator; of containers, whose image has been built before,
no less is comparable. *Pictures*: those of a running demo simulator. *Relay*: a server behind the guard's relay, and the same server
reached directly. Docker has a daemon of its own here (tests/support/docker.py).
"""

import argparse
import asyncio
import contextlib
import os
import resource
import shutil
import socket
import statistics
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../.."))
from support.browser_client import LOCAL, Browser  # noqa: E402
from support.docker import DockerDaemon, files_below  # noqa: E402
from support.frames import Frames, running  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SimulationServer, program  # noqa: E402

PROGRAM = ("/bin/echo", "runs")
NETWORKS = ("host", "none", "internet")
IMAGES = "webots_cloud_bench/webots"
ECHO = """
import socket, sys
data = bytes(1 << 20)
server = socket.create_server(("127.0.0.1", int(sys.argv[1])))
while True:
    client, _ = server.accept()
    client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    while order := client.recv(1):
        if order == b"e":
            client.sendall(b"e")
        else:
            for _ in range(256):
                client.sendall(data)
"""


def server_with(sandbox, network, daemon=None):
    if sandbox != "docker":
        return SimulationServer(**LOCAL, sandbox=sandbox, network=network)
    templates = os.path.join(os.path.dirname(__file__), "../../../config/simulation/docker")
    return SimulationServer(**LOCAL, docker=True, network=network, display="none", dockerDir=os.path.abspath(templates), dockerImages=IMAGES,
                            environment=daemon.environment)


@contextlib.contextmanager
def docker_daemon(sandbox):
    """For containers; None for the others."""
    if sandbox != "docker":
        yield None
        return
    fonts = [path for folder in ("/etc/fonts", "/usr/share/fonts", "/var/cache/fontconfig") for path in files_below(folder)]
    with DockerDaemon() as daemon:
        daemon.import_image(f"{IMAGES}:R2025a-ubuntu22.04", {"/usr/local/webots/webots": program("webots-demo-simulator")},
                            ["/bin/sh", *fonts])
        yield daemon


def guards_command_line(server):
    for pid in server.simulators():
        with open(f"/proc/{pid}/cmdline", "rb") as file:
            words = file.read().decode().split("\0")[:-1]
        if words and words[0].endswith("webots-process-guard") and "--filter" in words[1:]:
            return words
    raise SystemExit("no simulator runs in a sandbox")


def command_lines(server, folder):
    """The guard's command line for a program without and with the sandbox, with another folder in place of the instance."""
    async def look():
        async with Browser(server) as browser:
            await browser.start()
            await browser.hear("webots:")
            return guards_command_line(server)

    words = without(asyncio.run(look()), "--group")  # which the server removes after the simulation
    instance = os.path.join(server.instances_folder(), "1")
    words = [word.replace(instance, folder) for word in words]
    if "--network" in words:
        words[words.index("--network") + 2] = "0"
    while "--group" in words:  # it is removed with the simulation
        at = words.index("--group")
        del words[at:at + 2]
    end = words.index("--filter") + 1
    grace = next(number for number, word in enumerate(words) if word.isdigit() and words[number + 1].startswith("/") and
                 words[number + 1].endswith(("/bwrap", "/firejail")))
    return [*without(words[:grace + 1], "--own-sandbox"), *PROGRAM], [*words[:end], *PROGRAM]


def without(words, option):
    """A command line without an option, and the word after it, wherever it is."""
    left = list(words)
    while option in left:
        place = left.index(option)
        del left[place:place + 2]
    return left


def milliseconds(command):
    """Until the program runs; what happens after its end delays nobody."""
    ours, theirs = socket.socketpair()
    began = time.monotonic()
    process = subprocess.Popen(command, stdin=theirs, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    said = process.stdout.readline()
    took = (time.monotonic() - began) * 1e3
    process.stdout.close()
    process.wait()
    ours.close()
    theirs.close()
    if said != b"runs\n":
        raise SystemExit(f"{command}: {said.decode()}")
    return took


def processor_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def measure_start(sandbox, network, rounds):
    folder = tempfile.mkdtemp(prefix="webots_cloud_sandbox_bench_")
    os.mkdir(os.path.join(folder, "worlds"))
    try:
        with server_with(sandbox, network) as server:
            pair = command_lines(server, folder)
            taken, used = ([], []), [0, 0]
            for number in range(rounds + 2):
                for which, command in enumerate(pair):
                    before = processor_seconds()
                    took = milliseconds(command)
                    if number > 1:
                        taken[which].append(took)
                        used[which] += (processor_seconds() - before) * 1e3 / rounds
    finally:
        shutil.rmtree(folder)
    plain, within = map(statistics.median, taken)
    added = statistics.median(b - a for a, b in zip(*taken))
    return f"| start, `{network}` | {plain:.1f} ms | {within:.1f} ms | {added:+.1f} ms |\n" \
           f"| processor time of a start, `{network}` | {used[0]:.1f} ms | {used[1]:.1f} ms | {used[1] - used[0]:+.1f} ms |"


async def time_simulation(server):
    """In milliseconds."""
    async with Browser(server) as browser:
        began = time.monotonic()
        await browser.start()
        await browser.hear("webots:")
        took = (time.monotonic() - began) * 1e3
    await asyncio.to_thread(server.wait_until_clean)
    return took


def measure_simulation(sandbox, daemon, network, rounds):
    times = ([], [])
    with server_with("none", network) as plain, server_with(sandbox, network, daemon) as walled:
        for number in range(rounds + 1):
            for server, taken in zip((plain, walled), times):
                took = asyncio.run(time_simulation(server))
                if number > 0:  # the first one builds the image
                    taken.append(took)
    plain, within = map(statistics.median, times)
    added = statistics.median(b - a for a, b in zip(*times))
    return f"| simulation, `{network}` | {plain:.0f} ms | {within:.0f} ms | {added:+.0f} ms |"


async def pictures_per_second(port, seconds):
    async with running(port):
        frames = Frames(port)
        await asyncio.to_thread(frames.wait_for_next, "at all")
        before, began = frames.count, time.monotonic()
        await asyncio.sleep(seconds)
        rate = (frames.count - before) / (time.monotonic() - began)
        frames.close()
        return rate


async def measure_pictures(sandbox, daemon, network, rounds):
    rates = ([], [])
    with server_with("none", network) as plain, server_with(sandbox, network, daemon) as walled:
        async with Browser(plain) as first, Browser(walled) as second:
            ports = []
            for browser in (first, second):
                await browser.start()
                ports.append(int((await browser.hear("webots:")).rpartition(":")[2]))
            for _ in range(rounds):
                for port, rate in zip(ports, rates):
                    rate.append(await pictures_per_second(port, 2))
    first, second = map(statistics.median, rates)
    ratio = statistics.median(b / a for a, b in zip(*rates))
    return f"| pictures a second, `{network}` | {first:.2f} | {second:.2f} | × {ratio:.3f} |"


class Served:
    """A server under the guard."""

    def __init__(self, *options):
        self.port = free_port()
        self.ours, theirs = socket.socketpair()
        command = [program("webots-process-guard"), *[str(each).replace("PORT", str(self.port)) for each in options], "100",
                   "/usr/bin/python3", "-c", ECHO, str(self.port)]
        self.process = subprocess.Popen(command, stdin=theirs)
        theirs.close()
        self.connection = self._connect()

    def _connect(self):
        end = time.monotonic() + 10
        while True:
            try:
                connection = socket.create_connection(("127.0.0.1", self.port))
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                return connection
            except OSError:
                if time.monotonic() > end:
                    raise
                time.sleep(0.02)

    def round_trip(self):
        """In microseconds: the median of many."""
        times = []
        for _ in range(2000):
            began = time.perf_counter()
            self.connection.sendall(b"e")
            self.connection.recv(1)
            times.append((time.perf_counter() - began) * 1e6)
        return statistics.median(times)

    def throughput(self):
        """In megabytes a second."""
        self.connection.sendall(b"s")
        left = 256 << 20
        buffer = bytearray(1 << 18)
        began = time.perf_counter()
        while left > 0:
            left -= self.connection.recv_into(buffer, min(left, len(buffer)))
        return 268 / (time.perf_counter() - began)

    def close(self):
        self.connection.close()
        self.ours.close()
        self.process.wait()


def measure_relay(rounds):
    direct, relayed = Served(), Served("--network", "none", "PORT")
    rows = []
    try:
        for name, unit, figure in (("a round trip", "µs", Served.round_trip), ("throughput", "MB/s", Served.throughput)):
            values = ([], [])
            for _ in range(rounds):
                for value, served in zip(values, (direct, relayed)):
                    value.append(figure(served))
            plain, within = map(statistics.median, values)
            ratio = statistics.median(b / a for a, b in zip(*values))
            rows.append(f"| {name} through the relay | {plain:.0f} {unit} | {within:.0f} {unit} | × {ratio:.2f} |")
    finally:
        direct.close()
        relayed.close()
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sandbox", choices=("bubblewrap", "firejail", "docker"), default="bubblewrap")
    parser.add_argument("--rounds", type=int, default=40)
    chosen = parser.parse_args()
    few = max(3, chosen.rounds // 5)
    print(f"| medians | without {chosen.sandbox} | with | medians of pairs |\n|---|---:|---:|---:|")
    with docker_daemon(chosen.sandbox) as daemon:
        for network in NETWORKS:
            print(measure_simulation(chosen.sandbox, daemon, network, few) if daemon else
                  measure_start(chosen.sandbox, network, chosen.rounds), flush=True)
        for network in NETWORKS:
            print(asyncio.run(measure_pictures(chosen.sandbox, daemon, network, few)), flush=True)
    if chosen.sandbox == "bubblewrap":
        print("\n".join(measure_relay(few)))


if __name__ == "__main__":
    main()
