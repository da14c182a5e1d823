#!/usr/bin/python3
"""Runs the examples, whose code the documentation shows, and compares their output with what it promises."""

import contextlib
import http.client
import http.server
import os
import re
import subprocess
import sys
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.ports import free_port  # noqa: E402
from support.projects import EXAMPLES  # noqa: E402
from support.servers import BIN, main, program, wait_until  # noqa: E402

FOLDER = os.path.dirname(os.path.abspath(EXAMPLES))


def run(example, *arguments, cwd=None):
    finished = subprocess.run([program(example), *arguments], capture_output=True, text=True, timeout=60, cwd=cwd)
    return finished.returncode, finished.stdout + finished.stderr


class Machine(http.server.BaseHTTPRequestHandler):
    """A simulation server that only answers GET /load."""

    def do_GET(self):
        self.send_response(200 if self.path == "/load" else 404)
        self.end_headers()
        self.wfile.write(b"12.5")

    def log_message(self, *_):
        pass


@contextlib.contextmanager
def machine():
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Machine)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextlib.contextmanager
def serving(test, example, *machines):
    """Runs an example that prints where it listens, and ends it with SIGTERM, which it must obey."""
    with subprocess.Popen([program(example), "0", *machines], stdout=subprocess.PIPE, text=True) as process:
        try:
            lines = iter(process.stdout.readline, "")
            yield next(int(found[1]) for found in (re.match(r"listening on port (\d+)", line) for line in lines) if found)
        finally:
            process.terminate()
            status = process.wait(30)
        test.assertEqual(status, 0)


def ask(port, method, path, body=None):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10)
    with contextlib.closing(connection):
        connection.request(method, path, body)
        answer = connection.getresponse()
        return answer.status, answer.read().decode()


class Examples(unittest.TestCase):
    def test_the_documentation_shows_the_first_example_as_it_is_compiled(self):
        with open(os.path.join(FOLDER, "01_schedule.cpp"), encoding="utf-8") as source:
            example = source.read()
        with open(os.path.join(FOLDER, "..", "docs", "library.md"), encoding="utf-8") as page:
            self.assertIn("```cpp\n" + example[example.index("#include"):] + "```", page.read())

    def test_01_the_scheduler_spreads_browsers(self):
        status, text = run("01_schedule")
        self.assertEqual(status, 0, text)
        self.assertEqual(text.count("sim2.example.org:2000"), 4, text)
        self.assertEqual(text.count("sim1.example.org:2000"), 1, text)

    def test_02_a_load_arrives_by_coroutine_and_by_callback(self):
        self.assertEqual(run("02_monitor_with_callbacks"), (0, "coroutine: load 12.5 %\ncallback: load 12.5 %\n"))

    def test_03_a_transport_of_ones_own(self):
        self.assertEqual(run("03_own_transport"), (0, "sim1:2000: 40.000000 %\nsim2:2000: 10.000000 %\n"
                                                      "sim3:2000: nobody is at http://sim3:2000/load\n"))

    def test_04_a_simulation_without_a_browser(self):
        world = "local:/demo_projects/robots/blob/main/worlds/arena.wbt"
        self.assertEqual(run("04_run_a_simulation", BIN, FOLDER, world), (0, "ready: it listens\nended: after it was ready\n"))
        relative = run("04_run_a_simulation", os.path.basename(BIN), FOLDER, world, cwd=os.path.dirname(BIN))
        self.assertEqual(relative, (0, "ready: it listens\nended: after it was ready\n"))
        status, text = run("04_run_a_simulation", BIN, FOLDER, world.replace("arena", "nowhere"))
        self.assertEqual((status, text), (1, "nowhere.wbt does not exist.\n"))

    def test_05_both_servers_in_one_program(self):
        ports = [str(free_port()), str(free_port(following=100))]
        process = subprocess.Popen([program("05_embed_both"), BIN, FOLDER, *ports], stdout=subprocess.PIPE, text=True)
        with process:
            try:
                lines = iter(process.stdout.readline, "")
                said = []
                wait_until(lambda: said.append(next(lines)) or f"Session server running on port {ports[0]}" in said[-1], "a start")
            finally:
                process.terminate()
            self.assertEqual(process.wait(30), 0)

    def test_05_ports_that_are_none_are_answered_with_the_usage(self):
        for ports in (("x", "y"), ("1999", "70000"), ("0", "2000"), ("1999", "2000x")):
            status, text = run("05_embed_both", BIN, FOLDER, *ports)
            self.assertEqual(status, 2, text)
            self.assertTrue(text.startswith("usage: "), text)

    def test_06_a_policy_of_ones_own(self):
        status, text = run("06_own_policy")
        self.assertEqual(status, 0, text)
        self.assertIn("decided again: ", text)
        self.assertIn("decision 1: sim1:2000 because", text)

    def test_07_a_session_server_composed_by_hand_sends_browsers_to_the_machine_that_it_polls(self):
        with machine() as address, serving(self, "07_session_server", address) as port:
            wait_until(lambda: ask(port, "GET", "/session") == (200, "ws://" + address), "a machine for the browser")

    def test_08_the_scheduler_behind_a_server_of_ones_own(self):
        with serving(self, "08_behind_your_server", "sim1:2000", "sim2:2000") as port:
            self.assertEqual(ask(port, "GET", "/session"), (200, "Error: no simulation server available at the moment."))
            self.assertEqual(ask(port, "PUT", "/load/sim1:2000", "40"), (200, ""))
            self.assertEqual(ask(port, "PUT", "/load/sim2:2000", '{"load":10,"sessions":1}'), (200, ""))
            self.assertEqual(ask(port, "GET", "/session"), (200, "ws://sim2:2000"))
            self.assertEqual(ask(port, "PUT", "/load/sim2:2000", "idle")[0], 400)
            self.assertEqual(ask(port, "PUT", "/load/sim3:2000", "0")[0], 404)
            self.assertEqual(ask(port, "PUT", "/drain/sim2:2000"), (200, ""))
            self.assertEqual(ask(port, "GET", "/session"), (200, "ws://sim1:2000"))
            self.assertEqual(ask(port, "PUT", "/drain/sim1:2000"), (200, ""))
            self.assertEqual(ask(port, "GET", "/session"), (200, "Error: no simulation server available at the moment."))
            self.assertEqual(ask(port, "DELETE", "/drain/sim1:2000"), (200, ""))
            self.assertEqual(ask(port, "GET", "/session"), (200, "ws://sim1:2000"))
            self.assertEqual(ask(port, "PUT", "/drain/sim3:2000")[0], 404)
            self.assertEqual(ask(port, "GET", "/elsewhere")[0], 404)

    def test_07_and_08_say_how_they_are_used(self):
        for example in ("07_session_server", "08_behind_your_server"):
            for arguments in ((), ("1999",), ("x", "sim1:2000"), ("70000", "sim1:2000")):
                status, text = run(example, *arguments)
                self.assertEqual(status, 2, text)
                self.assertTrue(text.startswith("usage: "), text)

    def test_no_example_swallows_an_exception(self):
        for name in sorted(os.listdir(FOLDER)):
            if name.endswith(".cpp"):
                with open(os.path.join(FOLDER, name), encoding="utf-8") as source:
                    text = source.read()
                named = re.findall(r"std::exception_ptr\b(?: (\w+))?", text)
                self.assertEqual(len(named), text.count("std::rethrow_exception(failure);"), name)
                self.assertTrue(all(word == "failure" for word in named), name)


if __name__ == "__main__":
    main()
