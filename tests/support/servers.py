"""The real servers for tests: each in a folder of its own, on a free port of the loopback, ended with its context.

    with SimulationServer(allowedRepositories=[git.url]) as simulation, SessionServer([simulation.address]) as session:
        ...
"""

import contextlib
import functools
import json
import os
import resource
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import unittest
import urllib.error
import urllib.request

from .ports import free_port
from .processes import Startable
from .waiting import PATIENCE, wait_until

BIN = os.path.abspath(os.environ.get("WEBOTS_CLOUD_BIN", ""))  # servers are started in folders of their own


def program(name):
    """The path of one of our programs; SkipTest where it is not built."""
    path = os.path.join(BIN, name)
    if not os.access(path, os.X_OK):
        raise unittest.SkipTest(f"{name} is not built (WEBOTS_CLOUD_BIN={BIN!r})")
    return path


@functools.cache
def is_sanitized(name):
    """Sanitizers keep what was freed, so that the memory of what they watch only grows; and they reserve terabytes."""
    with open(program(name), "rb") as file:
        code = file.read()
    return b"__asan_init" in code or b"__tsan_init" in code


def descendants(pid):
    """All living processes below `pid`."""
    children = {}
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            with contextlib.suppress(OSError), open(f"/proc/{entry}/stat") as stat:
                fields = stat.read().rpartition(")")[2].split()
                if fields[0] not in "ZX":
                    children.setdefault(int(fields[1]), []).append(int(entry))
    found, todo = [], [pid]
    while todo:
        for child in children.get(todo.pop(), []):
            found.append(child)
            todo.append(child)
    return found


def is_alive(pid):
    with contextlib.suppress(OSError), open(f"/proc/{pid}/stat") as stat:
        return stat.read().rpartition(")")[2].split()[0] not in "ZX"
    return False


def without_systemd(environment):
    """An environment that names no folders of a service that we may be."""
    return {name: value for name, value in environment.items() if name not in ("STATE_DIRECTORY", "RUNTIME_DIRECTORY")}


def end(process):
    """Ends a process that we started, if it has not ended by itself."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class Server(Startable):
    """One of our servers as a process."""

    PROGRAM = ""

    arguments = ()  # of the command line, before the configuration
    descriptors = None  # a limit of open files
    wrapper = ()  # a command line that the program's is put behind
    user = None  # who runs it; None: we
    umask = -1  # what it is started with; -1: ours

    def __init__(self, config, port, environment=None):
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_server_")
        self.port = port
        self.address = f"localhost:{port}"
        self.url = f"{'https' if 'sslCertificate' in config else 'http'}://localhost:{port}"
        self.config = {"server": "localhost", "ssl": False, "portRewrite": False, "debug": True, "port": port, **config}
        self.environment = environment or {}
        self.process = None

    def configure(self, **keys):
        """Writes the configuration, with other values of some keys; returns its path."""
        path = os.path.join(self.folder, "config.json")
        with open(path, "w") as file:
            json.dump({**self.config, **keys}, file)
        return path

    def reread(self, **keys):
        """Changes the configuration of the running server."""
        self.configure(**keys)
        self.process.send_signal(signal.SIGHUP)

    def start(self):
        path = self.configure()
        os.makedirs(os.path.join(self.folder, "tmp"), exist_ok=True)
        environment = {**without_systemd(os.environ), "HOME": self.folder, "TMPDIR": os.path.join(self.folder, "tmp"),
                       "XDG_CACHE_HOME": os.path.join(self.folder, "cache"), "XDG_STATE_HOME": os.path.join(self.folder, "state"),
                       "XDG_RUNTIME_DIR": "", **self.environment}
        with open(self.log_path, "ab") as log:
            self.process = subprocess.Popen([*self.wrapper, self.program(), *self.arguments, path], stdin=subprocess.DEVNULL, stdout=log,
                                            stderr=log, env=environment, cwd=self.folder, preexec_fn=self._limit, user=self.user, umask=self.umask,
                                            group=self.user, extra_groups=None if self.user is None else [])
        wait_until(lambda: self.process.poll() is not None or self.get("/load"), f"{self.PROGRAM} does not answer")
        if self.process.poll() is not None:
            raise AssertionError(f"{self.PROGRAM} ended at once:\n{self.log()}")

    def program(self):
        return program(self.PROGRAM)

    def _limit(self):
        if self.descriptors:
            resource.setrlimit(resource.RLIMIT_NOFILE, (self.descriptors, self.descriptors))

    def get(self, path, headers=None):
        """The body of an answer, or None when the server can't be reached."""
        request = urllib.request.Request(self.url + path, headers=headers or {})
        try:
            with urllib.request.urlopen(request, timeout=10, context=ssl._create_unverified_context()) as answer:
                return answer.read().decode()
        except (urllib.error.URLError, ConnectionError):
            return None

    def ask(self, path, method="GET", headers=None, body=b""):
        """Status and body of an answer, whatever the status. `body` is that of a POST."""
        request = urllib.request.Request(self.url + path, data=body if method == "POST" else None, headers=headers or {}, method=method)
        try:
            answer = urllib.request.urlopen(request, timeout=PATIENCE, context=ssl._create_unverified_context())
        except urllib.error.HTTPError as refusal:
            answer = refusal
        with answer:
            return answer.status, answer.read().decode()

    def operator_socket(self):
        kind = self.PROGRAM.split("-")[1]
        return os.path.join(self.folder, "tmp", f"webots-{os.geteuid()}", f"{kind}-{self.port}.sock")

    def command(self, *options, wrapper=()):
        """Runs the program with an operator's option: its exit status and output. `wrapper`: what starts it, if anything."""
        environment = {**os.environ, "HOME": self.folder, "TMPDIR": os.path.join(self.folder, "tmp"), "XDG_RUNTIME_DIR": "",
                       **self.environment}
        finished = subprocess.run([*wrapper, program(self.PROGRAM), *options, os.path.join(self.folder, "config.json")], capture_output=True,
                                  text=True, env=environment, cwd=self.folder, timeout=PATIENCE)
        return finished.returncode, (finished.stdout + finished.stderr).strip()

    def figures(self):
        """Memory in kilobytes, threads and descriptors."""
        with open(f"/proc/{self.process.pid}/status") as status:
            values = dict(line.split(":", 1) for line in status)
        descriptors = len(os.listdir(f"/proc/{self.process.pid}/fd")) if os.geteuid() == 0 else None  # nobody else may look
        return int(values["VmRSS"].split()[0]), int(values["Threads"]), descriptors

    def is_sanitized(self):
        return is_sanitized(self.PROGRAM)

    def stop(self, signal_number=signal.SIGTERM):
        """Ends it and returns its exit status."""
        self.process.send_signal(signal_number)
        return self.process.wait(PATIENCE)

    def close(self):
        if self.process:
            end(self.process)
        if os.environ.get("SHOW_LOGS"):
            print(self.log(), file=sys.stderr)
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def log_path(self):
        return os.path.join(self.folder, "output.log")

    def log(self):
        with open(self.log_path, errors="replace") as file:
            return file.read()


class SessionServer(Server):
    PROGRAM = "webots-session-server"

    def __init__(self, simulation_servers, port=0, environment=None, **config):
        # The machine that runs the tests may be busy: that is not what most of them are about.
        super().__init__({"simulationServers": simulation_servers, "loadRefresh": 0.5, "loadThreshold": 1000, **config},
                         port or free_port(), environment)


class SimulationServer(Server):
    """Runs the demo simulator, with faults as its command line knows them; it draws on no display, so none is started for it."""

    PROGRAM = "webots-simulation-server"

    def __init__(self, port=0, faults="", environment=None, **config):
        config = {"notify": [], "maxConnections": 20, "sandbox": "auto" if config.get("docker") else "none", "simulationUser": "none",
                  "gateway": False, **config}
        if is_sanitized(self.PROGRAM):  # what sanitizers reserve counts as memory where there are no control groups
            config.setdefault("simulationMemory", 0)
        port = port or free_port(following=config["maxConnections"] + 10)
        super().__init__(config, port, {"WEBOTS_DEMO_FAULTS": faults, "WEBOTS_DEMO_ADDRESS": "127.0.0.1", "DISPLAY": ":0", **(environment or {})})

    def state_folder(self):
        return self.config.get("stateDir", os.path.join(self.folder, "state", "webots_cloud"))

    def instances_folder(self):
        return os.path.join(self.state_folder(), str(self.port), "instances")

    def instances(self):
        """The instance directories that exist."""
        root = self.instances_folder()
        return os.listdir(root) if os.path.isdir(root) else []

    def simulators(self):
        """Processes below the server: simulators, their guards and whatever they started."""
        return descendants(self.process.pid)

    def wait_until_clean(self):
        wait_until(lambda: not self.simulators(), f"processes are left: {self.simulators()}\n{self.log()}")
        wait_until(lambda: not self.instances(), f"directories are left: {self.instances()}\n{self.log()}")


def port_is_free(port):
    """Whether a server could listen there: the port is neither in use nor reserved."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(("0.0.0.0", port))
            probe.listen()
            return True
        except OSError:
            return False


def main():
    """Runs the tests of the calling script; exits with 77 when all of them were skipped."""
    result = unittest.main(exit=False, verbosity=2).result
    if not result.wasSuccessful():
        sys.exit(1)
    if result.testsRun <= len(result.skipped):  # fewer, when a whole module was skipped
        for _, why in result.skipped[:1]:
            print("skipped:", why)
        sys.exit(77)
