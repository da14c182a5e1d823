#!/usr/bin/python3
"""What the gateway costs beside nginx and HAProxy, which relay the same streams on the same machine in the same run: the table of docs/gateway_costs.md.

    cmake --build --preset release --target bench
    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/gateway_bench.py [--runs 3] [--only WORD] [--quick]

The gateway in question has one core; the simulations and the viewers share the other. *Streams*: WebSockets that are sent 64 kB messages as fast
as they take them. *Pictures*: messages of 10 kB, 20 a second for each of up to 100 viewers, 3 a second for each of 1,000. *Files* of 1 MB over
connections that are kept. *TLS on both sides*: a second gateway of ours, on the core of the simulations, speaks TLS in front of them. Streams need
small buffers, and so root and a network namespace of their own: else viewers would still read, while we measure, what the kernel kept for them before. Added latency is from the simulation to the viewer, less what it is without a gateway. Packages: nginx-light, haproxy.

On a virtual machine whose host gives the processors to others for a moment, pictures wait for milliseconds, whoever relays them. A measurement of latency during which the host
took more than 0.5 % of the processors' time is made again.
"""

import argparse
import contextlib
import os
import random
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", ".."))
sys.path[:0] = [HERE, os.path.join(HERE, "..")]
from peers import LOAD_CORE, SERVER_CORE, Tool, cpu_seconds, find, memory, on_core, stolen_seconds, wait_for_port  # noqa: E402
from speed_bench import machine, shown  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, program  # noqa: E402

# As people configure them for WebSockets, with room for 1,000 viewers.
NGINX = """
worker_processes 1; daemon off; master_process off; pid {folder}/pid; error_log {folder}/error; worker_rlimit_nofile 8192;
events {{ worker_connections 8192; multi_accept on; }}
http {{
    access_log off; keepalive_requests 1000000000; ssl_protocols TLSv1.2 TLSv1.3;
    client_body_temp_path {folder}; proxy_temp_path {folder}; fastcgi_temp_path {folder}; uwsgi_temp_path {folder};
    scgi_temp_path {folder};
    map $http_upgrade $connection_upgrade {{ default upgrade; "" close; }}
    server {{
        listen 127.0.0.1:{port} {tls}; {certificate}
        location / {{
            proxy_pass {scheme}://127.0.0.1:{upstream}; {trust}
            proxy_http_version 1.1; proxy_set_header Host $host;
            proxy_set_header Upgrade $http_upgrade; proxy_set_header Connection $connection_upgrade;
            proxy_set_header X-Forwarded-For $proxy_add_x_forwarded_for;
            proxy_buffering off; proxy_read_timeout 600s;
        }}
    }}
}}
"""

HAPROXY = """
global
    nbthread 1
    maxconn 8192
defaults
    mode http
    timeout client 60s
    timeout server 60s
    timeout connect 5s
    timeout tunnel 1h
    option forwardfor
frontend viewers
    bind 127.0.0.1:{port} {tls}
    default_backend simulations
backend simulations
    http-reuse never
    server simulation 127.0.0.1:{upstream} {trust}
"""


MOST_STOLEN = 0.005  # of the processors' time, by the host
MOST_TRIES = 30


class Disturbed(Exception):
    """The host of this machine left no time to measure in."""


class Certificate:
    def __init__(self, folder):
        self.certificate, self.key, self.both = (os.path.join(folder, name) for name in ("certificate.pem", "key.pem", "both.pem"))
        subprocess.run([find("openssl"), "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                        "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-out", self.certificate,
                        "-keyout", self.key], check=True, capture_output=True)
        with open(self.both, "w") as both:
            for path in (self.certificate, self.key):
                with open(path) as part:
                    both.write(part.read())


class Gateway:
    """Ours, nginx or HAProxy, in front of `upstream`, which speaks TLS if `is_inner`: then its certificate is verified."""

    def __init__(self, name, upstream, certificate, folder, is_inner=False, core=SERVER_CORE):
        self.port = free_port()
        home = os.path.join(folder, f"{name}_{self.port}")
        os.mkdir(home)
        command = {
            "ours": lambda: [program("speed_gateway"), str(self.port), str(upstream),
                             *((certificate.certificate, certificate.key) if certificate else ()),
                             *((certificate.certificate,) if is_inner else ())],
            "nginx": lambda: [find("nginx"), "-p", home, "-c", self.write(home, NGINX.format(
                folder=home, port=self.port, upstream=upstream, tls="ssl" if certificate else "", scheme="https" if is_inner else "http",
                trust=f"proxy_ssl_verify on; proxy_ssl_name localhost; proxy_ssl_trusted_certificate {certificate.certificate};"
                if is_inner else "",
                certificate=f"ssl_certificate {certificate.certificate}; ssl_certificate_key {certificate.key};" if certificate else ""))],
            "HAProxy": lambda: [find("haproxy"), "-db", "-f", self.write(home, HAPROXY.format(
                port=self.port, upstream=upstream, tls=f"ssl crt {certificate.both}" if certificate else "",
                trust=f"ssl verify required verifyhost localhost ca-file {certificate.certificate}" if is_inner else ""))],
        }[name]()
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=on_core(core))
        wait_for_port(self.port)

    @staticmethod
    def write(home, text):
        path = os.path.join(home, "configuration")
        with open(path, "w") as file:
            file.write(text)
        return path

    @property
    def pid(self):
        return self.process.pid

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(PATIENCE)


class Direct:
    """No gateway: what the simulations and viewers need by themselves."""

    pid = None

    def __init__(self, port):
        self.port = port

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass


class Bench:
    def __init__(self, folder, seconds, most_stolen):
        self.folder = folder
        self.seconds = seconds
        self.most_stolen = most_stolen
        self.certificate = Certificate(folder)
        self.disturbed = 0  # measurements that were made again
        self.not_measured = []  # rows
        self.port = free_port()
        self.simulations = Tool("simulations", self.port)
        wait_for_port(self.port)
        self.machine = Gateway("ours", self.port, self.certificate, folder, core=LOAD_CORE)  # speaks TLS in front of the simulations

    def gateway(self, name, tls):
        """`tls`: none, with the viewers, or "both": with the other server too."""
        if name == "direct":
            return Direct(self.port)
        if tls == "both":
            return Gateway(name, self.machine.port, self.certificate, self.folder, is_inner=True)
        return Gateway(name, self.port, self.certificate if tls else None, self.folder)

    @contextlib.contextmanager
    def viewers(self, gateway, count, target, tls):
        with Tool("viewers", gateway.port, count, target, "tls" if tls else "plain") as viewers:
            viewers.hear("connected")
            time.sleep(0.5 + count / 300 * (target == "/flood"))  # caches are cold, and buffers empty
            yield viewers

    def load(self, name, count, target, tls):
        """Bytes relayed, messages, median and 99th percentile in microseconds, the gateway's seconds of processor, and the share that the host took."""
        buffers = small_buffers() if target == "/flood" else contextlib.nullcontext()
        with buffers, self.gateway(name, tls) as gateway, self.viewers(gateway, count, target, tls and name != "direct") as viewers:
            viewers.ask("begin")
            spent = cpu_seconds(gateway.pid) if gateway.pid else 0
            crossed = bytes_on_the_network()
            stolen = stolen_seconds()
            time.sleep(self.seconds)
            answer = viewers.ask("end", "bytes")
            stolen = (stolen_seconds() - stolen) / self.seconds / os.cpu_count()
            spent = cpu_seconds(gateway.pid) - spent if gateway.pid else 0
            if crossed is not None:  # to the gateway, and from it, and to the one that speaks TLS for the simulations
                answer[0] = (bytes_on_the_network() - crossed) / (3 if tls == "both" else 2)
            return answer, spent, stolen

    def throughput(self, name, count, target, tls):
        """MB per second of the gateway's processor."""
        (transferred, *_), spent, _ = self.load(name, count, target, tls)
        return transferred / 1e6 / spent

    def latency(self, name, count, tls, direct):
        period = 333_333 if count >= 1000 else 50_000
        for _ in range(MOST_TRIES):
            (_, messages, median, worst), spent, stolen = self.load(name, count, f"/pictures?10000,{period}", tls)
            if stolen <= self.most_stolen:
                break
            self.disturbed += 1
        else:
            raise Disturbed
        if not messages:
            raise SystemExit(f"{name}: no pictures arrived")
        return {"median": median - direct["median"], "p99": worst - direct["p99"], "cpu": spent * 1e6 / messages} if direct else \
            {"median": median, "p99": worst}

    def idle_memory(self, name, count, tls):
        """kB for each tunnel: not counted what the first few need."""
        with self.gateway(name, tls) as gateway, self.viewers(gateway, 10, "/idle", tls):
            before = memory(gateway.pid)
            with self.viewers(gateway, count, "/idle", tls):
                return (memory(gateway.pid) - before) / count / 1e3

    def stalled_memory(self, name, count, tls):
        """kB for each viewer that has stopped to read: after a second, and how much was added in the following seconds."""
        with small_buffers(), self.gateway(name, tls) as gateway, self.viewers(gateway, 10, "/idle", tls):
            before = memory(gateway.pid)
            with self.viewers(gateway, count, "/flood", tls) as viewers:
                viewers.ask("stall")
                time.sleep(self.seconds + 4)  # until all buffers of the kernel are full
                first = memory(gateway.pid)
                time.sleep(self.seconds)
                return {"first": (first - before) / count / 1e3, "growth": (memory(gateway.pid) - first) / count / 1e3}


def enter_own_network():
    """Buffers of sockets are the kernel's for all of a network."""
    if os.geteuid() != 0:
        print("Not run as root: what sockets buffer is not limited, and rows with many streams are too high.\n")
    elif not has_own_network():
        os.environ["WEBOTS_CLOUD_BENCH_NETWORK"] = "own"
        os.execvp("unshare", ["unshare", "--net", sys.executable, *sys.argv])
    else:
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)


def has_own_network():
    return os.environ.get("WEBOTS_CLOUD_BENCH_NETWORK") == "own"


def bytes_on_the_network():
    """That were sent so far, by everybody; None where others use the network as well.

    What viewers have read is no measure of a gateway's work: on a busy machine they may read for seconds what it had sent before.
    """
    if not has_own_network():
        return None
    with open("/proc/net/netstat") as file:
        keys, values = (line.split() for line in file if line.startswith("IpExt:"))
    return int(values[keys.index("OutOctets")])


@contextlib.contextmanager
def small_buffers():
    """Of sockets that are made meanwhile."""
    if not has_own_network():
        yield
        return
    paths = [f"/proc/sys/net/ipv4/{name}" for name in ("tcp_rmem", "tcp_wmem")]
    kept = []
    for path in paths:
        with open(path, "r+") as setting:
            kept.append(setting.read())
            setting.write("4096 65536 262144")
    try:
        yield
    finally:
        for path, value in zip(paths, kept):
            with open(path, "w") as setting:
                setting.write(value)


NAMES = ("ours", "nginx", "HAProxy")


def row(work, unit, samples, goal, better):
    """`samples`: of each name a list; `better(ours, theirs)`: the ratio that should be at least one.

    Medians over all runs are compared, as the better of two others in each run would be the luckier of them.
    """
    peers = {name: values for name, values in samples.items() if name != "ours"}
    ours = statistics.median(samples["ours"])
    ratio = min(better(ours, statistics.median(values)) for values in peers.values())
    reached = "yes" if ratio >= 1 else "**no**"
    print(f"| {work} | {unit} | {shown(samples['ours'])} | " + " | ".join(shown(values) for values in peers.values()) +
          f" | {goal} | {ratio:.3g} | {reached} |", flush=True)


def more(ours, theirs):
    return ours / theirs


def less(ours, theirs):
    return theirs / ours if ours > 0 else 1.0


def turns(runs, measure):
    samples = {name: [] for name in NAMES}
    for _ in range(runs):
        for name in NAMES:
            samples[name].append(measure(name))
    return samples


def throughput_rows(bench, options, tls, label):
    targets = [("streams", "/flood", count) for count in (1, 100, 1000)] + [("files of 1 MB", "/file?1000000", count) for count in (1, 100)]
    for kind, target, count in targets:
        work = f"{label}, {kind}, {count:,} viewer{'s' if count > 1 else ''}"
        if options.only not in work:
            continue
        row(work, "MB per second of processor", turns(options.runs, lambda name: bench.throughput(name, count, target, tls)),
            "at least the better", more)


def latencies(bench, count, tls):
    direct = bench.latency("direct", count, tls, None)
    order = random.sample(NAMES, len(NAMES))  # who comes after whom must not matter
    return {name: bench.latency(name, count, tls, direct) for name in order}


def latency_rows(bench, options, tls, label):
    for count in (1, 100, 1000):
        work = f"{label}, pictures, {count:,} viewer{'s' if count > 1 else ''}"
        if options.only not in work:
            continue
        try:
            samples = [latencies(bench, count, tls) for _ in range(options.runs)]
        except Disturbed:
            bench.not_measured.append(work)
            continue
        for key, unit in (("median", "added µs, median"), ("p99", "added µs, 99th percentile"), ("cpu", "µs of processor for each")):
            row(work, unit, {name: [sample[name][key] for sample in samples] for name in NAMES}, "at most the better", less)


def memory_rows(bench, options, tls, label):
    work = f"{label}, idle tunnels, 1,000"
    if options.only in work:
        row(work, "kB for each", turns(options.runs, lambda name: bench.idle_memory(name, 1000, tls)), "at most the better", less)
    work = f"{label}, viewers that stopped to read, 100"
    if options.only in work:
        samples = turns(options.runs, lambda name: bench.stalled_memory(name, 100, tls))
        row(work, "kB for each", {name: [value["first"] for value in values] for name, values in samples.items()}, "at most the better", less)
    work = f"{label}, viewers that stopped to read, 1,000"
    if options.only in work:
        samples = turns(options.runs, lambda name: bench.stalled_memory(name, 1000, tls))
        row(work, "kB for each", {name: [value["first"] for value in values] for name, values in samples.items()}, "at most the better", less)
        growth = [value["growth"] for value in samples["ours"]]
        print(f"| {work} | kB more for each, later | {shown(growth)} | | | flat | | {'yes' if max(growth) < 0.1 else '**no**'} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=3)
    parser.add_argument("--only", metavar="WORD", default="", help="rows whose name contains the word")
    parser.add_argument("--quick", action="store_true", help="one short run, to see that everything works")
    options = parser.parse_args()
    if options.quick:
        options.runs, options.seconds = 1, 0.5
    enter_own_network()
    resource.setrlimit(resource.RLIMIT_NOFILE, (resource.getrlimit(resource.RLIMIT_NOFILE)[1],) * 2)
    folder = tempfile.mkdtemp(prefix="webots_cloud_gateway_")
    try:
        bench = Bench(folder, options.seconds, 1 if options.quick else MOST_STOLEN)
        with bench.simulations, bench.machine:
            print(machine((("nginx", "-v"), ("haproxy", "-v"))) + "\n")
            print("| what | unit | ours | nginx | HAProxy | goal | ratio | reached |\n|---|---|---:|---:|---:|---|---:|---|", flush=True)
            for tls, label in ((False, "plain"), (True, "TLS"), ("both", "TLS on both sides")):
                throughput_rows(bench, options, tls, label)
                latency_rows(bench, options, tls, label)
                memory_rows(bench, options, tls, label)
            print(f"\n{bench.disturbed} measurements of latency were made again, since the host took more than {MOST_STOLEN:.1%} of the processors.")
            if bench.not_measured:
                raise SystemExit(f"Not measured, as it did so {MOST_TRIES} times in a row: {'; '.join(bench.not_measured)}. Try later.")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    main()
