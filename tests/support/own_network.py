"""A network namespace for the calling script, with a small internet: other machines, public and private.

    enter()            # at the start of the script: runs it again in there; SkipTest-like exit where that is not allowed
    with Outside() as outside: ...
    with Elsewhere() as other: ...  # one more machine, with its own network; cable(None, other, "10.79.0") joins them
"""

import os
import shutil
import subprocess
import sys

from .processes import end_with_parent
from .waiting import wait_until

MARK = "WEBOTS_CLOUD_OWN_NETWORK"
PUBLIC = "93.184.215.14"  # an address of nobody's in here
OWN = "10.78.0.1"
PRIVATE = "10.78.0.2"
SHARED = "100.64.3.3"
METADATA = "169.254.169.254"


def enter():
    """Replaces this process by one that runs the script in network and mount namespaces of its own."""
    if os.environ.get(MARK):
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        return
    if os.geteuid() != 0 or not shutil.which("unshare") or subprocess.run(["unshare", "-nm", "true"], check=False).returncode != 0:
        print("skipped: a network namespace of our own needs root")
        sys.exit(77)
    os.environ[MARK] = "1"
    os.execvp("unshare", ["unshare", "-nm", "--propagation", "private", sys.executable, os.path.abspath(sys.argv[0]), *sys.argv[1:]])


SERVER = r"""
import http.server, threading
class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        self.send_response(200); self.end_headers(); self.wfile.write(b"outside")
    def log_message(self, *_): pass
http.server.ThreadingHTTPServer(("0.0.0.0", 80), Handler).serve_forever()
"""


class Outside:
    """Other machines, all of them one namespace at the other end of a cable, with a web server on port 80."""

    def __enter__(self):
        self.process = subprocess.Popen(["unshare", "-n", sys.executable, "-c", "import os, sys; sys.stdin.readline()\n" + SERVER],
                                        stdin=subprocess.PIPE)
        number = str(self.process.pid)
        wait_until(lambda: os.readlink(f"/proc/{number}/ns/net") != os.readlink("/proc/self/ns/net"), "no other namespace")
        self._run("ip", "link", "add", "cable", "type", "veth", "peer", "name", "far", "netns", number)
        self._run("ip", "address", "add", f"{OWN}/24", "dev", "cable")
        self._run("ip", "link", "set", "cable", "up")
        inside = ["nsenter", "-t", number, "-n", "ip"]
        self._run(*inside, "link", "set", "lo", "up")
        for address in (f"{PRIVATE}/24", f"{PUBLIC}/32", f"{SHARED}/32", f"{METADATA}/32"):
            self._run(*inside, "address", "add", address, "dev", "far")
        self._run(*inside, "link", "set", "far", "up")
        self._run("ip", "route", "add", "default", "via", PRIVATE)
        self.process.stdin.write(b"\n")
        self.process.stdin.close()
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()

    @staticmethod
    def _run(*command):
        subprocess.run(command, check=True)


class Elsewhere:
    """A machine with a network of its own, and no cable yet. What runs there runs behind `wrapper`."""

    def __enter__(self):
        self.process = subprocess.Popen(["unshare", "-n", "sleep", "infinity"], preexec_fn=end_with_parent)
        number = str(self.process.pid)
        wait_until(lambda: os.readlink(f"/proc/{number}/ns/net") != os.readlink("/proc/self/ns/net"), "no other namespace")
        self.wrapper = ("nsenter", "-t", number, "-n", "--")
        subprocess.run([*self.wrapper, "ip", "link", "set", "lo", "up"], check=True)
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


def cable(near, far, network):
    """Joins two machines (None: that of the script): they are `<network>.1` and `<network>.2`. Neither passes anything on."""
    name = network.replace(".", "_")
    for machine, end, number in ((near, f"a{name}", 1), (far, f"b{name}", 2)):
        ip = [*(machine.wrapper if machine else ()), "ip"]
        if number == 1:
            subprocess.run([*ip, "link", "add", end, "type", "veth", "peer", "name", f"b{name}", "netns", str(far.process.pid)], check=True)
        subprocess.run([*ip, "address", "add", f"{network}.{number}/24", "dev", end], check=True)
        subprocess.run([*ip, "link", "set", end, "up"], check=True)
