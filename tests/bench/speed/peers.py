"""What the benchmark starts: our servers and their peers, each pinned to the servers' core, the load on the other."""

import contextlib
import os
import re
import shutil
import socket
import subprocess
import tempfile
import time

from support.ports import free_port
from support.servers import BIN, PATIENCE, SessionServer, SimulationServer, program, wait_until

SERVER_CORE, LOAD_CORE = 0, 1


def on_core(core):
    """For preexec_fn."""
    return lambda: os.sched_setaffinity(0, {core})


def stolen_seconds():
    """Of all processors, that the host of this virtual machine has given to others so far, while somebody here wanted them."""
    with open("/proc/stat") as file:
        return int(file.readline().split()[8]) / os.sysconf("SC_CLK_TCK")


def cpu_seconds(pid):
    """Processor time of a process and its threads (the clock that clock_getcpuclockid(3) names)."""
    return time.clock_gettime(~pid << 3 | 2)


def memory(pid, key="VmRSS"):
    """Bytes."""
    with open(f"/proc/{pid}/status") as status:
        return int(re.search(rf"^{key}:\s*(\d+) kB", status.read(), re.MULTILINE)[1]) * 1024


class Tool:
    """One of our load generators; `say` sends it a line, `hear` returns the numbers of the next line that begins with a word."""

    def __init__(self, name, *arguments, core=LOAD_CORE):
        self.process = subprocess.Popen([program(f"speed_{name}"), *map(str, arguments)], text=True, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, preexec_fn=on_core(core))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.process.stdin.close()
        self.process.stdout.close()

    @property
    def pid(self):
        return self.process.pid

    def say(self, line):
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def hear(self, word):
        for line in self.process.stdout:
            if line.startswith(word):
                return [float(number) for number in re.findall(r"(?<= )-?\d+(?:\.\d+)?", line)]
        raise AssertionError(f"{self.process.args} ended before it said {word!r}")

    def ask(self, line, word="ok"):
        self.say(line)
        return self.hear(word)


class Machines(Tool):
    """`count` simulation servers that answer polls."""

    def __init__(self, count):
        self.port = free_port()
        super().__init__("machines", self.port)
        first = (127 << 24 | 1 << 16) + 1
        self.addresses = [".".join(str(first + number >> shift & 255) for shift in (24, 16, 8, 0)) + f":{self.port}"
                          for number in range(count)]

    def polls(self):
        return self.ask("polls", "polls")[0]


class PinnedSessionServer(SessionServer):
    def __init__(self, machines, **config):
        super().__init__(machines.addresses, loadThreshold=95, **{"loadRefresh": 5, **config})

    def _limit(self):
        os.sched_setaffinity(0, {SERVER_CORE})
        super()._limit()

    @property
    def pid(self):
        return self.process.pid

    def wait_for_polls(self, machines):
        wait_until(lambda: machines.polls() >= len(machines.addresses), "not all machines were polled", patience=60)


class FreeSimulationServer(SimulationServer):
    """Not pinned: git, guards and simulators run beside it. `webots` is our stand-in that is ready at once."""

    def __init__(self, **config):
        super().__init__(webotsHome=stand_in_home(), **config)

    @property
    def pid(self):
        return self.process.pid


def stand_in_home():
    home = os.path.join(BIN, "speed_simulator_home")
    os.makedirs(home, exist_ok=True)
    link = os.path.join(home, "webots")
    if not os.path.exists(link):
        os.symlink(program("speed_simulator"), link)
    return home


class Floor(Tool):
    """`kind` of speed_floor (or of another program) on a port of its own."""

    def __init__(self, kind, program_name="floor"):
        self.port = free_port()
        super().__init__(program_name, kind, self.port, core=SERVER_CORE)
        wait_for_port(self.port)


NGINX = """
worker_processes 1; daemon off; master_process off; pid {folder}/pid; error_log {folder}/error;
events {{ worker_connections 8192; multi_accept on; }}
http {{
    access_log off; keepalive_requests 1000000000; default_type text/html;
    client_body_temp_path {folder}; proxy_temp_path {folder}; fastcgi_temp_path {folder}; uwsgi_temp_path {folder};
    scgi_temp_path {folder};
    server {{ listen 127.0.0.1:{port}; location / {{ return 200 "ws://localhost:2000"; }} }}
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
frontend constant
    bind 127.0.0.1:{port}
    http-request return status 200 content-type text/html string "ws://localhost:2000"
"""


class Peer:
    """nginx or HAProxy with a constant answer."""

    def __init__(self, name):
        self.port = free_port()
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_speed_")
        configuration = os.path.join(self.folder, "configuration")
        text, command = {
            "nginx": (NGINX, ["nginx", "-p", self.folder, "-c", configuration]),
            "HAProxy": (HAPROXY, ["haproxy", "-db", "-f", configuration])}[name]
        with open(configuration, "w") as file:
            file.write(text.format(folder=self.folder, port=self.port))
        self.process = subprocess.Popen([find(command[0]), *command[1:]], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                        preexec_fn=on_core(SERVER_CORE))
        wait_for_port(self.port)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait(PATIENCE)
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def pid(self):
        return self.process.pid


def find(command):
    path = shutil.which(command, path=os.environ["PATH"] + ":/usr/sbin")
    if not path:
        raise SystemExit(f"{command} is not installed (a Debian package of that name, wrk and nginx-light too)")
    return path


def wait_for_port(port):
    def answers():
        with contextlib.suppress(OSError):
            socket.create_connection(("127.0.0.1", port), timeout=1).close()
            return True
    wait_until(answers, f"nothing listens on port {port}")
