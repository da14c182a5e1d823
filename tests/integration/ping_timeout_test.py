#!/usr/bin/python3
"""Browsers that fall asleep: a program that is stopped (SIGSTOP) answers no ping, like a laptop whose lid is closed.

The Python servers send no pings (protocol section 4.1), so that a simulation of a sleeping laptop lives until TCP gives up, and one of a
laptop that is gone too. Ours says in the log why a simulation has ended, and `pingTimeout` how long it waits.
"""

import json
import os
import signal
import subprocess
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, server  # noqa: E402
from support import raw_websocket  # noqa: E402
from support.servers import SessionServer, end, main, wait_until  # noqa: E402

PING = b"\x89\x00"

LAPTOP = """
import asyncio, json, sys, websockets

async def main():
    async with websockets.connect(sys.argv[1], ping_interval=None) as socket:
        await socket.send(json.dumps({"start": {"url": sys.argv[2], "mode": "mjpeg"}}))
        async for message in socket:
            print(message, flush=True)

try:
    asyncio.run(main())
except websockets.ConnectionClosed:
    print("closed", flush=True)
"""


class Laptop:
    """A browser in a process of its own, which can be put to sleep."""

    def __init__(self, simulation):
        self.process = subprocess.Popen([sys.executable, "-c", LAPTOP, simulation.url.replace("http", "ws", 1) + "/client", WORLD],
                                        stdout=subprocess.PIPE, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.wake()
        end(self.process)
        self.process.stdout.close()

    def hear(self, beginning):
        for line in self.process.stdout:
            if line.startswith(beginning):
                return line.strip()
        raise AssertionError(f"never heard {beginning}")

    def sleep(self):
        self.process.send_signal(signal.SIGSTOP)

    def wake(self):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)


class PingTimeout(unittest.TestCase):
    WHY = "The simulation has lost its browser: the browser answered no ping for 2 s: it may be asleep, or its network gone " \
          "(\"pingTimeout\"); "

    def test_a_laptop_that_sleeps_longer_loses_its_simulation_and_the_log_says_why(self):
        with server(pingTimeout=2) as simulation, Laptop(simulation) as awake:
            awake.hear("webots:")
            others = simulation.simulators()
            with Laptop(simulation) as laptop:
                laptop.hear("webots:")
                laptop.sleep()
                wait_until(lambda: simulation.simulators() == others and len(simulation.instances()) == 1, simulation.log)
                self.assertIn("[2] " + self.WHY + "it is ended at once, since there is no \"reconnectGrace\"", simulation.log())
                laptop.wake()
                laptop.hear("closed")
            # A browser that was as silent, but answered pings, is still connected.
            self.assertNotIn("[1] The simulation has lost", simulation.log())

    def test_with_a_grace_it_may_return(self):
        with server(pingTimeout=2, reconnectGrace=600) as simulation, Laptop(simulation) as laptop:
            laptop.hear("reconnectToken:")
            laptop.sleep()
            wait_until(lambda: self.WHY + "it may return for 600.0 s" in simulation.log(), "nobody missed it")
            self.assertTrue(simulation.simulators())

    def test_without_a_limit_a_laptop_that_wakes_up_finds_its_simulation(self):
        with server(pingTimeout=0) as simulation, Laptop(simulation) as laptop:
            laptop.hear("webots:")
            laptop.sleep()
            with Laptop(simulation) as other:  # lives longer than the shortest limit
                other.hear("webots:")
                other.hear(".")  # after 5 s
            laptop.wake()
            laptop.hear(".")
            self.assertNotIn("[1] The simulation has lost", simulation.log())


class PingInterval(unittest.TestCase):
    def test_a_browser_is_pinged_while_its_start_is_silent(self):
        start = json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}).encode()
        with server(pingInterval=1, faults="never-ready") as simulation, raw_websocket.open_websocket(simulation, "/client") as browser:
            browser.sendall(raw_websocket.frame(0x81, start))
            wait_until(lambda: "started: " in simulation.log(), simulation.log)
            heard = b""
            while heard.count(PING) < 3 and (part := browser.recv(4096)):
                heard += part
            self.assertEqual(heard.count(PING), 3)
            self.assertNotIn(b"webots:", heard)

    def test_it_is_read_from_the_configuration_of_a_session_server(self):
        with SessionServer([], pingInterval=1) as session, raw_websocket.open_websocket(session) as browser:
            heard = b""
            while heard.count(PING) < 2 and (part := browser.recv(4096)):
                heard += part
            self.assertEqual(heard, b"\x81\x010" + 2 * PING)


if __name__ == "__main__":
    main()
