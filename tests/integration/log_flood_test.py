#!/usr/bin/python3
"""Clients can't flush a server's log: repeated lines are left out and counted, the server's own lines are all there."""

import json
import os
import re
import sys
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, server as simulation_server  # noqa: E402
from support.raw_websocket import connect, frame, open_websocket, read_all  # noqa: E402
from support.servers import SessionServer, main, wait_until  # noqa: E402

REFUSALS = 100_000
PONG = frame(0x8a, b"end", masked=False)


def send_all(connection, data):
    """Sends while another thread reads, so that neither side waits for the other; returns what came back."""
    sender = threading.Thread(target=connection.sendall, args=(data,))
    sender.start()
    received = bytearray()
    while not received.endswith(PONG):
        part = connection.recv(1 << 20)
        if not part:
            break
        received += part
    sender.join()
    return bytes(received)


class Floods(unittest.TestCase):
    def log(self, server, kind):
        path = os.path.join(server.folder, "log", kind, "output.log")
        self.assertFalse(os.path.exists(path + ".1"), "the log was rotated")
        with open(path) as file:
            return file.read()

    def check_end(self, server, kind, first_line, example):
        """Ends the server; the beginning of its log must be unchanged, and say how many lines were left out."""
        self.assertEqual(server.stop(), 0)
        text = self.log(server, kind)
        self.assertIn(first_line, "\n".join(text.splitlines()[:2]))  # the first one may be about Landlock
        counted = [int(number) for number in re.findall(example + r".*? \((\d+) more like this in the last \d+ s\)$", text, re.MULTILINE)]
        self.assertGreater(sum(counted), REFUSALS * 9 // 10, text[-2000:])

    def test_messages_of_one_websocket(self):
        with SessionServer(["127.0.0.1:1"], debug=False) as server:
            wait_until(lambda: "running" in self.log(server, "session"), "the first line")
            with open_websocket(server) as browser:
                send_all(browser, b"".join(frame(0x81, b"%06d" % i + b"x" * 100) for i in range(REFUSALS)) + frame(0x89, b"end"))
            self.check_end(server, "session", "Session server running", "Ignored client message: ")

    def test_requests_for_what_is_not_there(self):
        with SessionServer(["127.0.0.1:1"], debug=False) as server:
            wait_until(lambda: "running" in self.log(server, "session"), "the first line")
            requests = b"".join(b"GET /nope/%06d HTTP/1.1\r\nHost: localhost\r\n\r\n" % i for i in range(REFUSALS))
            with connect(server) as client:
                sender = threading.Thread(target=client.sendall, args=(requests + b"GET /load HTTP/1.0\r\n\r\n",))
                sender.start()
                self.assertGreater(read_all(client).count(b"HTTP/1.1 404 "), REFUSALS - 1)
                sender.join()
            self.check_end(server, "session", "Session server running", "404 GET /nope/")

    def test_many_websockets_that_ask_for_nonsense(self):
        refusals = 3_000  # each with a socket of its own, and three lines
        with simulation_server(debug=False) as server:
            wait_until(lambda: "Running" in self.log(server, "simulation"), "the first line")
            for i in range(refusals):
                with open_websocket(server, "/client") as browser:
                    start = {"start": {"url": f"https://nowhere.org/{i}/" + "x" * 300}}
                    browser.sendall(frame(0x81, json.dumps(start).encode()))
                    answer = b""
                    while not answer.endswith(b"\x88\x00"):
                        answer += browser.recv(4096)
                    self.assertIn(b"Unsupported URL protocol", answer)
            self.assertEqual(server.stop(), 0)
            text = self.log(server, "simulation")
            self.assertIn("Running simulation server", text)
            self.assertLess(text.count("Unsupported URL protocol"), 500)
            told = re.findall(r"Unsupported URL protocol.*\((\d+) more like this", text)
            self.assertGreater(text.count("Unsupported URL protocol") - len(told) + sum(map(int, told)) + len(told), refusals - 1)


class RunningSimulation(unittest.TestCase):
    """As once happened: a controller that does not exist, reset again and again."""

    def test_refusals_of_one_simulation(self):
        refusals = 20_000  # of some 400 bytes each: more than all files of the log hold
        with simulation_server(debug=False) as server:
            with open_websocket(server, "/client") as browser:
                browser.sendall(frame(0x81, json.dumps({"start": {"url": WORLD, "mode": "mjpeg"}}).encode()))
                told = b""
                while b"webots:" not in told:
                    told += browser.recv(4096)
                ask = frame(0x81, json.dumps({"reset controller": "x" * 200 + "/" + "y" * 100 + ".py"}).encode())
                sender = threading.Thread(target=browser.sendall, args=(ask * refusals,))
                sender.start()
                answers, rest = 0, b""
                while answers < refusals:
                    part = browser.recv(1 << 20)
                    self.assertTrue(part, f"{answers} answers, and the server closed")
                    whole, found, rest = (rest + part).rpartition(b"loading: Error: ")
                    answers += (whole + found).count(b"loading: Error: ")
                sender.join()
            self.assertEqual(server.stop(), 0)
            folder = os.path.join(server.folder, "log", "simulation")
            self.assertFalse(os.path.exists(os.path.join(folder, "output.log.1")))
            with open(os.path.join(folder, "output.log")) as file:
                text = file.read()
            for line in ("Running simulation server", "New client", "Starting simulation", "ready to receive", "was killed"):
                self.assertIn(line, text)
            counted = [int(number) for number in re.findall(r" \((\d+) more like this in the last \d+ s\)$", text, re.MULTILINE)]
            self.assertEqual(sum(counted) + len(counted) + 10, refusals, text[-2000:])


if __name__ == "__main__":
    main()
