"""The session server's rows."""

import contextlib
import functools
import itertools
import re
import socket
import statistics
import subprocess
import threading
import time
import urllib.request
from collections import Counter

from peers import (LOAD_CORE, Floor, Machines, Peer, PinnedSessionServer, Tool, cpu_seconds, find, memory, on_core)
from row import Row, itself, ratio
from support.servers import wait_until

RARELY = {"loadRefresh": 600}  # no poll while something else is measured


def wrk(port, connections, seconds):
    """Requests that were answered, and the 99th percentile in microseconds."""
    out = subprocess.run([find("wrk"), "-t1", f"-c{connections}", f"-d{seconds}s", "--latency", f"http://127.0.0.1:{port}/session"],
                         capture_output=True, text=True, check=True, preexec_fn=on_core(LOAD_CORE)).stdout
    number, unit = re.search(r"99%\s+([\d.]+)(us|ms|s)", out).groups()
    if "Non-2xx" in out:
        raise AssertionError(out)
    return int(re.search(r"(\d+) requests in", out)[1]), float(number) * {"us": 1, "ms": 1e3, "s": 1e6}[unit]


@contextlib.contextmanager
def servers(counts=(10,), peers=("nginx", "HAProxy"), floor="http"):
    """All sides at once, each idle while another is measured: {"ours": ..., "nginx": ...}."""
    with contextlib.ExitStack() as stack:
        running = {}
        for count in counts:
            machines = stack.enter_context(Machines(count))
            server = stack.enter_context(PinnedSessionServer(machines, **RARELY))
            server.wait_for_polls(machines)
            running["ours" if count == counts[0] else f"ours with {count:,} machines"] = server
        for name in peers:
            running[name] = stack.enter_context(Peer(name))
        if floor:
            running["Beast"] = stack.enter_context(Floor(floor, "beast"))
            running["floor"] = stack.enter_context(Floor(floor))
        yield running


@contextlib.contextmanager
def cost_of_session(quick, machines=10):
    with servers((machines,)) as running:
        def measure():
            sample = {}
            for name, server in running.items():
                before = cpu_seconds(server.pid)
                requests, _ = wrk(server.port, 64, 1 if quick else 2)
                sample[name] = (cpu_seconds(server.pid) - before) * 1e6 / requests
            return sample
        yield measure


@contextlib.contextmanager
def tail_of_session(quick):
    with servers() as running:
        yield lambda: {name: wrk(server.port, 256, 1 if quick else 2)[1] for name, server in running.items()}


@contextlib.contextmanager
def idle_memory(_quick):
    def measure():
        with servers(floor=None, peers=("nginx",)) as running:
            ours = running["ours"].pid
            wait_until(lambda: memory(ours) < 0.8 * memory(ours, "VmHWM"), "the pages of the start have not been given back")
            return {"ours": memory(ours) / 1e6, "of that shared libraries and program": memory(ours, "RssFile") / 1e6,
                    "nginx": memory(running["nginx"].pid) / 1e6}
    yield measure


@functools.cache  # three rows look at the same runs
def crowd(count, _run):
    """Connects browsers to ours and to the floor, flips the availability six times on each."""
    with Machines(1) as machines, PinnedSessionServer(machines, loadRefresh=0.1) as server, Floor("websocket") as floor:
        server.wait_for_polls(machines)
        sample = {}
        for name, peer in (("ours", server), ("floor", floor)):
            before = memory(peer.pid)
            with Tool("browsers", peer.port, count) as crowd_of_browsers:
                seconds = crowd_of_browsers.hear("connected")[0]
                held = (memory(peer.pid) - before) / count / 1e3
                flips = []
                for flip in range(6):
                    if name == "ours":
                        machines.say(f"load {'99' if flip % 2 == 0 else '10'}")
                        begin = machines.hear("answered")[0]
                    else:
                        begin = peer.ask("flip", "sent")[0]
                    flips.append((crowd_of_browsers.hear("all")[0] - begin) / 1e6)
                sample[name] = {"rate": count / seconds, "memory": held, "flip": statistics.median(flips)}
        return sample


@contextlib.contextmanager
def memory_of_browsers(quick):
    of_ours = of_crowd("memory")

    def of_beast(count):
        with Floor("websocket", "beast") as peer:
            before = memory(peer.pid)
            with Tool("browsers", peer.port, count) as crowd_of_browsers:
                crowd_of_browsers.hear("connected")
                return (memory(peer.pid) - before) / count / 1e3

    with of_ours(quick) as measure:
        yield lambda: {**measure(), "Beast": of_beast(500 if quick else 10_000)}


def of_crowd(key):
    """A setting whose samples are one figure of `crowd`."""
    @contextlib.contextmanager
    def setting(quick):
        runs = itertools.count()
        yield lambda: {name: values[key] for name, values in crowd(500 if quick else 10_000, next(runs)).items()}
    return setting


PAUSE = 1.2  # seconds; who waits is told of changes at most once a second


@functools.cache  # two rows look at the same runs
def waiting_room(count, _run):
    """Browsers that wait for a seat, and the first of them leaves 16 times; in turns with that, the floor tells as many browsers of its own of a change."""
    watchers = crowd(count, _run)
    with Machines(1) as machines, PinnedSessionServer(machines, relay=True, waitingRoom=count, loadRefresh=0.1) as server, \
            Floor("websocket") as floor:
        machines.say("load 99")  # no seat is free
        machines.hear("answered")
        server.wait_for_polls(machines)
        before = memory(server.pid)
        with Tool("waiters", server.port, count) as waiters, Tool("browsers", floor.port, count) as browsers:
            waiters.hear("connected")
            browsers.hear("connected")
            time.sleep(PAUSE)  # of those who came last, others have yet to hear
            held = (memory(server.pid) - before) / count / 1e3
            changes, flips = [], []
            for _ in range(16):
                left = waiters.ask("leave", "left")[0]
                changes.append((waiters.hear("all")[0] - left) / 1e6)
                time.sleep(PAUSE / 2)
                sent = floor.ask("flip", "sent")[0]
                flips.append((browsers.hear("all")[0] - sent) / 1e6)
                time.sleep(PAUSE / 2)
    return {"memory": {"ours": held, "watching the availability": watchers["ours"]["memory"]},
            "change": {"ours": statistics.median(changes), "floor": statistics.median(flips)}}


def of_waiting_room(key):
    """A setting whose samples are one figure of `waiting_room`."""
    @contextlib.contextmanager
    def setting(quick):
        runs = itertools.count()
        yield lambda: waiting_room(500 if quick else 10_000, next(runs))[key]
    return setting


def cost_of_polls(closing):
    @contextlib.contextmanager
    def setting(quick):
        count, rounds = (100, 2) if quick else (5000, 4)

        def measure():
            with Machines(count) as machines:
                machines.ask(f"closing {'on' if closing else 'off'}")
                with Tool("floor", "poll", machines.port, count, rounds, "closing" if closing else "kept", core=0) as floor:
                    floors = floor.hear("cpu_us_per_poll")[0]
                with PinnedSessionServer(machines, loadRefresh=2) as server:
                    server.wait_for_polls(machines)
                    before, polls = cpu_seconds(server.pid), machines.polls()
                    wait_until(lambda: machines.polls() >= polls + rounds * count, "the polls stop", patience=120)
                    ours = (cpu_seconds(server.pid) - before) / (machines.polls() - polls)
            return {"ours": ours * 1e6, "floor": floors}
        yield measure
    return setting


@contextlib.contextmanager
def reader_of(url):
    """Somebody who reads a page a little less often than it is made anew, once a second."""
    done = threading.Event()
    headers = {"Accept-Encoding": "gzip"}  # as browsers and Prometheus

    def read():
        while not done.wait(1.1):
            urllib.request.urlopen(urllib.request.Request(url, headers=headers)).read()
    thread = threading.Thread(target=read)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def wait_while_polled(count, hanging, page=""):
    @contextlib.contextmanager
    def setting(quick):
        machines_count = min(count, 100) if quick else count

        def measure():
            with Machines(machines_count) as machines:
                if hanging:
                    machines.ask("hang 0")
                with PinnedSessionServer(machines) as server:
                    wait_until(lambda: machines.polls() >= machines_count - hanging, "not all were polled", patience=60)
                    reader = reader_of(server.url + page) if page else contextlib.nullcontext()
                    with reader, Tool("probe", server.port, "/session", 100, 2 if quick else 8) as probe:
                        _, lost, median, _, longest = probe.hear("requests")
            if lost:
                raise AssertionError(f"{lost} requests got no answer")
            return {"ours": longest / 1e3, "median": median / 1e3}
        yield measure
    return setting


@contextlib.contextmanager
def herd(quick):
    seconds = 1 if quick else 4

    def measure():
        with Machines(10) as machines, PinnedSessionServer(machines) as server:
            server.wait_for_polls(machines)
            sent_to = Counter()
            for number in range(50 * seconds):
                sent_to[urllib.request.urlopen(server.url + "/session").read()] += 1
                time.sleep(0.02)
            return {"ours": max(sent_to.values()), "equal shares": 5 * seconds}
    yield measure


@contextlib.contextmanager
def start_to_answer(_quick):
    """From fork to the first whole answer of GET /session."""
    def measure():
        with Machines(10) as machines:
            with Starting(machines) as server:
                return {"ours": server.milliseconds}
    yield measure


class Starting(PinnedSessionServer):
    """Measures its own start."""

    milliseconds = 0.0

    def get(self, path, headers=None):
        if not self.milliseconds:
            request = b"GET /session HTTP/1.1\r\nHost: localhost\r\n\r\n"
            while self.process.poll() is None:
                with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port)) as connection:
                    connection.sendall(request)
                    if connection.recv(4096).startswith(b"HTTP/1.1 200"):
                        break
            self.milliseconds = (time.monotonic() - self.began) * 1e3
        return super().get(path, headers)

    def start(self):
        self.began = time.monotonic()
        super().start()


class HalfRequests(PinnedSessionServer):
    descriptors = 1024


@contextlib.contextmanager
def half_requests(_quick, count=1100):
    """GET /session, and what the server uses meanwhile, while `count` connections hold half a request under 1,024 descriptors."""
    def measure():
        with Machines(10) as machines, HalfRequests(machines) as server, contextlib.ExitStack() as stack:
            server.wait_for_polls(machines)
            for _ in range(count):
                connection = stack.enter_context(socket.create_connection(("127.0.0.1", server.port)))
                with contextlib.suppress(OSError):  # the oldest have to make room
                    connection.sendall(b"GET /session HTTP/1.1\r\nHost: loc")
            before, begin = cpu_seconds(server.pid), time.monotonic()
            waits = []
            for _ in range(20):
                asked = time.monotonic()
                urllib.request.urlopen(server.url + "/session", timeout=5).read()
                waits.append((time.monotonic() - asked) * 1e3)
                time.sleep(0.1)
            used = (cpu_seconds(server.pid) - before) / (time.monotonic() - begin)
            return {"ours": max(waits), "% of a core": used * 100}
    yield measure


ROWS = [
    Row("`GET /session`, 64 connections, 10 machines known", "µs of processor", "at most 1.0 × nginx", 1.0, ratio("nginx"), cost_of_session),
    Row("`GET /session`, 64 connections, 5,000 machines known", "µs of processor", "at most 1.0 × nginx", 1.0, ratio("nginx"),
        lambda quick: cost_of_session(quick, 100 if quick else 5000)),
    Row("`GET /session`, 256 connections, 99th percentile", "µs", "at most nginx's", 1.0, ratio("nginx"), tail_of_session),
    Row("memory, idle", "MB", "at most 10 MB", 10, itself, idle_memory),
    Row("memory per idle browser, 10,000", "kB", "at most 3 kB", 3, itself, memory_of_browsers),
    Row("browsers connected", "per second", "at least 12,000", 1 / 12_000, lambda sample: 1 / sample["ours"], of_crowd("rate")),
    Row("a change reaches the last of 10,000 browsers", "ms", "at most 1.15 × floor", 1.15, ratio("floor"), of_crowd("flip")),
    Row("memory per browser in the waiting room, 10,000", "kB", "at most 1 kB more than one that watches", 1,
        lambda sample: sample["ours"] - sample["watching the availability"], of_waiting_room("memory")),
    Row("10,000 browsers in the waiting room learn their new position", "ms", "at most 1.15 × floor", 1.15, ratio("floor"),
        of_waiting_room("change")),
    Row("a poll, 5,000 machines, kept connections", "µs of processor", "at most 2 × floor", 2, ratio("floor"), cost_of_polls(False)),
    Row("a poll, 5,000 machines that close", "µs of processor", "at most 2 × floor", 2, ratio("floor"), cost_of_polls(True)),
    Row("longest wait of `GET /session` while 5,000 machines are polled", "ms", "at most 5 ms", 5, itself, wait_while_polled(5000, 0)),
    Row("longest wait of `GET /session` while `/metrics` of 5,000 machines is read each second", "ms", "at most 5 ms", 5, itself,
        wait_while_polled(5000, 0, "/metrics")),
    Row("longest wait of `GET /session` while `/monitor` of 5,000 machines is read each second", "ms", "at most 5 ms", 5, itself,
        wait_while_polled(5000, 0, "/monitor")),
    Row("longest wait of `GET /session`, one machine of 10 never answers", "ms", "at most 5 ms", 5, itself, wait_while_polled(10, 1)),
    Row("200 requests in 4 s on 10 equal machines: most on one", "requests", "at most 24", 24, itself, herd),
    Row("process start to first answer, 10 machines", "ms", "at most 20 ms", 20, itself, start_to_answer),
    Row("`GET /session` beside 1,100 half requests, 1,024 descriptors", "ms", "50 ms, 5 % of a core", 50, itself, half_requests),
]
