#!/usr/bin/python3
"""How long a project takes from the request to a directory that is ready, beside git itself and the floors of the machine.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/git_fetch/git_fetch_bench.py [--runs N] [--repositories FOLDER] [--quick] [--only NAME]

Everything is measured in one run, interleaved, against real git servers on the loopback; a table of medians is printed in
Markdown. FOLDER keeps the repositories for the next run. The suite runs the smallest form, so that the bench keeps working; figures
are not looked at there.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", ".."))
sys.path.insert(0, HERE)
from support.git_case import require_git_and_probe
from support.git_probe import Probe
from support.git_server import GitServer
from support.proxy import Proxy
from repositories import WANTED, make_all

COPIES = 32


def ready(answers):
    """The answers, if all of them are projects."""
    for answer in answers:
        if "error" in answer:
            raise RuntimeError(answer["error"])
    return answers


class Bench:
    def __init__(self, repositories, names, runs):
        self.repositories = repositories
        self.runs = runs
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_bench_")
        # On ext4, so that everybody's folders lie far from each other: what one row deletes must not slow the next one down.
        subprocess.run(["chattr", "+T", self.folder], stderr=subprocess.DEVNULL)
        self.server = GitServer()
        self.server.start()
        for name in names:
            path = os.path.join(repositories, name + ".git")
            self.server.link_repository("bench", name, path)
            for copy in range(COPIES):
                self.server.link_repository(f"bench{copy}", name, path)
        self.environment = dict(os.environ, HOME=self.server.folder, GIT_CONFIG_NOSYSTEM="1")

    def close(self):
        self.server.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def world(self, name, owner="bench"):
        folder = WANTED[name] + "/" if WANTED[name] else ""
        return f"{owner}/{name}/blob/main/{folder}worlds/demo.wbt"

    def timed(self, command):
        """Milliseconds of a shell command in an empty folder."""
        place = tempfile.mkdtemp(dir=self.folder)
        start = time.monotonic()
        subprocess.run(command, shell=True, cwd=place, check=True, env=self.environment, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
        took = (time.monotonic() - start) * 1000
        shutil.rmtree(place)
        return took

    def timed_by_a_script(self, command):
        """As the floors were that the goals were set with: a shell of its own, and the clock of the script that runs it."""
        place = tempfile.mkdtemp(dir=self.folder)
        script = 'begin=$(date +%s%N); bash -c "$1"; end=$(date +%s%N); echo $((end - begin))'
        finished = subprocess.run(["bash", "-c", script, "bash", command], cwd=place, check=True, env=self.environment,
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        shutil.rmtree(place)
        return int(finished.stdout) / 1e6

    def sent(self, action):
        """What `action` returns, megabytes that the server sent for it, and how often it was asked."""
        before = len(self.server.requests())
        result = action()
        requests = self.server.requests()[before:]
        return result, sum(request[3] for request in requests) / 1e6, len(requests)

    def clone(self, name, options=""):
        sparse = f"&& git sparse-checkout set {WANTED[name]} " if WANTED[name] else ""
        return (f"git clone --depth=1 {options} --no-checkout --branch main {self.server.url}/bench/{name}.git p && cd p "
                f"{sparse}&& git checkout main")

    def probe(self, may_mount=True):
        """One that hands out in the fastest way, or in the fastest for who may not mount."""
        probe = Probe(self.server.url, self.folder)
        probe.may_mount = may_mount
        return probe

    def cold(self, name, may_mount=True):
        probe = self.probe(may_mount)
        (answer,) = ready([probe.fetch(self.world(name), "--fastest", "--discard")])
        probe.close()
        return answer["ms"]

    def warm(self, probe, name):
        # The second of a process: servers run for weeks.
        return ready(probe.fetch_all([self.world(name)] * 2, "--fastest", "--discard"))[1]["ms"]

    def one_repository(self, name):
        """Rows of medians: milliseconds, megabytes, requests."""
        bare = os.path.join(self.repositories, name + ".git")
        copy = tempfile.mkdtemp(dir=self.folder)
        subprocess.run(f"git -C {bare} archive main {WANTED[name]} | tar x -C {copy}", shell=True, check=True, env=self.environment)
        copying, mounting = self.probe(may_mount=False), self.probe()
        for probe in (copying, mounting):
            probe.fetch(self.world(name), "--fastest", "--discard")
        actions = {
            "git clone --depth=1, sparse checkout": lambda: self.timed(self.clone(name)),
            "the same with --filter=blob:none": lambda: self.timed(self.clone(name, "--filter=blob:none")),
            f"**ours, cold**, {copying.way()}": lambda: self.cold(name, may_mount=False),
            f"**ours, cold**, {mounting.way()}": lambda: self.cold(name),
            "git ls-remote": lambda: self.timed(f"git ls-remote {self.server.url}/bench/{name}.git refs/heads/main"),
            "floor: git archive, tar": lambda: self.timed(f"git -C {bare} archive main {WANTED[name]} | tar x"),
            "floor: cp -r": lambda: self.timed(f"cp -r {copy}/. ."),
            "floor: cp -r, timed by a script": lambda: self.timed_by_a_script(f"cp -r {copy}/. ."),
            f"**ours, warm**, {copying.way()}": lambda: self.warm(copying, name),
            f"**ours, warm**, {mounting.way()}": lambda: self.warm(mounting, name)}
        samples = {row: [] for row in actions}
        for _ in range(self.runs):
            for row, action in actions.items():
                samples[row].append(self.sent(action))
        copying.close()
        mounting.close()
        shutil.rmtree(copy)
        return {row: tuple(statistics.median(column) for column in zip(*values)) for row, values in samples.items()}

    def crowd(self, name):
        """32 starts at once of one project, and of 32: milliseconds until the last is ready, requests, pauses, longest work."""
        probe = self.probe()
        options = ("--together", "--discard", "--fastest")
        same, _, requests = self.sent(lambda: ready(probe.fetch_all([self.world(name)] * COPIES, *options)))
        pause, work = probe.longest_pause_ms, probe.longest_work_ms
        probe.close()
        probe = self.probe()
        idle = self.idle_process(3_000)
        different = ready(probe.fetch_all([self.world(name, f"bench{copy}") for copy in range(COPIES)], *options))
        pause, work = max(pause, probe.longest_pause_ms), max(work, probe.longest_work_ms)
        probe.close()
        last = lambda answers: max(answer["ms"] for answer in answers)
        return last(same), requests, last(different), pause, self.pause_of(idle), work

    def idle_process(self, milliseconds):
        """A process that does nothing but beat: its pauses are those of the machine."""
        command = self.probe().command([], "--idle", str(milliseconds))
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)

    @staticmethod
    def pause_of(process):
        return json.loads(process.communicate()[0].splitlines()[-1])["longest_pause_ms"]

    def two_at_a_time(self, name):
        """Milliseconds that git needs for 32 partial or plain clones, whichever is faster, with two at a time."""
        def run(options):
            commands = [self.clone(name, options)] * COPIES
            lock = threading.Lock()

            def work():
                while True:
                    with lock:
                        if not commands:
                            return
                        command = commands.pop()
                    self.timed(command)

            start = time.monotonic()
            threads = [threading.Thread(target=work) for _ in range(2)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            return (time.monotonic() - start) * 1000
        return run("--filter=blob:none" if WANTED[name] else "")

    def distant(self, name, latency=0.05):
        """Milliseconds cold and warm through a proxy that adds `latency` to each round trip."""
        with Proxy(self.server.port, latency) as proxy:
            probe = Probe(f"http://127.0.0.1:{proxy.port}", self.folder)
            cold = ready([probe.fetch(self.world(name), "--fastest", "--discard")])[0]["ms"]
            warm = self.warm(probe, name)
            probe.close()
        return cold, warm


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--repositories", default="")
    parser.add_argument("--quick", action="store_true", help="without the crowds")
    parser.add_argument("--only", choices=WANTED, help="one of the repositories")
    options = parser.parse_args()
    require_git_and_probe()
    names = [options.only] if options.only else list(WANTED)
    with tempfile.TemporaryDirectory(prefix="webots_cloud_bench_repositories_") as temporary:
        repositories = options.repositories or temporary
        make_all(repositories, names)
        bench = Bench(repositories, names, options.runs)
        try:
            tables = {name: bench.one_repository(name) for name in names}
            print("| milliseconds, megabytes received, requests |" + "".join(f" {name} |" for name in tables))
            print("|---|" + "---|" * len(tables))
            for row in tables[names[0]]:
                cells = (tables[name][row] for name in tables)
                print(f"| {row} |" + "".join(f" {ms:.{0 if ms >= 10 else 1}f} ms, {mb:.2f} MB, {count:.0f} |" for ms, mb, count in cells))
            for row, index in (("ours, cold, 50 ms away", 0), ("ours, warm, 50 ms away", 1)):
                print(f"| {row} |" + "".join(f" {bench.distant(name)[index]:.0f} ms |" for name in tables))
            if not options.quick:
                crowds = {name: (*bench.crowd(name), bench.two_at_a_time(name)) for name in tables}
                for row, cell in ((f"{COPIES} starts of one project, the last is ready", lambda c: f"{c[0]:.0f} ms, {c[1]} requests"),
                                  (f"{COPIES} different projects, the last is ready", lambda c: f"{c[2]:.0f} ms"),
                                  (f"git clone, {COPIES} different, two at a time", lambda c: f"{c[6]:.0f} ms"),
                                  ("longest pause of the event loop meanwhile", lambda c: f"{c[3]:.1f} ms"),
                                  ("longest pause of an idle process meanwhile", lambda c: f"{c[4]:.1f} ms"),
                                  ("longest work of the event loop without a pause", lambda c: f"{c[5]:.1f} ms")):
                    print(f"| {row} |" + "".join(f" {cell(crowds[name])} |" for name in tables))
        finally:
            bench.close()


if __name__ == "__main__":
    main()
