#!/usr/bin/python3
"""How long GET /session waits while thousands of machines announce themselves and leave within a minute. No test: it says figures.

    WEBOTS_CLOUD_BIN=build/release/bin tests/bench/speed/discovery_bench.py [--machines 5000]

The machines answer polls, from one process. Each announces itself once, and says goodbye 27 s later. Requests come at a fixed rate
all the time, whether or not earlier ones have been answered.
"""

import argparse
import base64
import contextlib
import hashlib
import hmac
import http.client
import os
import secrets
import sys
import tempfile
import time
import urllib.parse

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "../.."))
from peers import LOAD_CORE, Machines, PinnedSessionServer, Tool, cpu_seconds  # noqa: E402

ARRIVAL_S, STAY_S = 25, 27
RATE = 200


class Announcer:
    def __init__(self, port, secret):
        self.connection = http.client.HTTPConnection("127.0.0.1", port)
        self.secret = secret.encode()
        self.receiver = "-"

    def say(self, machine, more=""):
        status, body = self.post(machine, f"&to={self.receiver}{more}")
        if status == 421:
            self.receiver = body.rpartition("to=")[2]
            status, _ = self.post(machine, f"&to={self.receiver}{more}")
        if status != 200:
            raise SystemExit(f"an announcement is answered {status}")

    def post(self, machine, more):
        query = f"machine={urllib.parse.quote(machine, safe='')}&at={int(1000 * time.time())}{more}"
        code = hmac.new(self.secret, b"webots_cloud announcement 1\n" + query.encode(), hashlib.sha256).digest()
        signature = base64.urlsafe_b64encode(code).decode().rstrip("=")
        self.connection.request("POST", f"/api/machines?{query}", b"", {"Authorization": f"Webots-Cloud {signature}", "Host": "localhost"})
        answer = self.connection.getresponse()
        return answer.status, answer.read().decode()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--machines", type=int, default=5000)
    count = parser.parse_args().machines
    secret = secrets.token_hex(32)
    os.sched_setaffinity(0, {LOAD_CORE})  # the server has a core of its own
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        file = os.path.join(folder, "secret")
        with open(file, "w") as written:
            os.chmod(file, 0o600)
            written.write(secret + "\n")
        machines = stack.enter_context(Machines(count))
        addresses, machines.addresses = machines.addresses, []
        server = stack.enter_context(PinnedSessionServer(machines, announcements=True, discoverLoopback=True, sessionSecret=file, sessionBurst=0))
        announcer = Announcer(server.port, secret)
        probe = stack.enter_context(Tool("probe", server.port, "/session", RATE, ARRIVAL_S + STAY_S + 5))
        used, begin = cpu_seconds(server.pid), time.monotonic()
        step = ARRIVAL_S / count
        plan = sorted([(i * step, address, "") for i, address in enumerate(addresses)] +
                      [(i * step + STAY_S, address, "&goodbye") for i, address in enumerate(addresses)])
        for due, address, more in plan:
            time.sleep(max(0, begin + due - time.monotonic()))
            announcer.say(address, more)
        seconds = time.monotonic() - begin
        used = cpu_seconds(server.pid) - used
        requests, lost, median, p99, longest = probe.hear("requests")
        print(f"{count:,} machines came and went in {seconds:.0f} s: of {requests:.0f} requests for /session {lost:.0f} were lost; "
              f"median {median / 1000:.2f} ms, 99 % {p99 / 1000:.2f} ms, longest {longest / 1000:.1f} ms; "
              f"{100 * used / seconds:.0f} % of a processor")


if __name__ == "__main__":
    main()
