#!/usr/bin/python3
"""The session server as a process, with small simulation servers of the test's own. Protocol sections 2, 3, 8.1 and 9.1."""

import asyncio
import contextlib
import json
import os
import re
import resource
import select
import signal
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.disks import mount_small_disk  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.machine import Machine  # noqa: E402
from support.servers import SessionServer, main, program, wait_until  # noqa: E402

try:
    from support import web_sockets as websockets
    from support.mailbox import CompletionQueue
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (packages python3-websockets, python3-aiosmtpd)") or 77)


def server_states(session):
    return [line for line in session.get("/metrics").splitlines() if line.startswith("webots_servers{")]


def read(path):
    """A log file, or nothing where there is none yet."""
    with contextlib.suppress(FileNotFoundError), open(path, errors="replace") as file:
        return file.read()
    return ""


class Sessions(unittest.IsolatedAsyncioTestCase):
    async def test_a_browser_is_sent_to_the_idle_machine_and_told_when_there_is_none(self):
        with Machine("80") as busy, Machine("5.5") as idle, SessionServer([busy.address, idle.address],
                                                                          loadThreshold=95) as session:
            wait_until(lambda: 'webots_servers{state="up"} 2' in server_states(session), "both are up")
            self.assertEqual(session.get("/"), "1")
            with urllib.request.urlopen(session.url + "/session?url=https://github.com/o/r") as answer:
                self.assertEqual(answer.read().decode(), f"ws://{idle.address}")
                self.assertEqual(answer.headers["Access-Control-Allow-Origin"], "*")
                self.assertEqual(answer.headers["Content-Type"], "text/html; charset=UTF-8")
            self.assertEqual(session.get("/load"), "42.75")
            async with websockets.connect(f"ws://localhost:{session.port}/") as browser:
                self.assertEqual(await browser.recv(), "1")
                busy.load = idle.load = "99"
                self.assertEqual(await asyncio.wait_for(browser.recv(), 30), "0")
                self.assertEqual(session.get("/session"), "Error: no simulation server available at the moment.")
                idle.load = "3"
                self.assertEqual(await asyncio.wait_for(browser.recv(), 30), "1")
            async with websockets.connect(f"ws://localhost:{session.port}/session") as browser:
                self.assertEqual(await browser.recv(), f"ws://{idle.address}")
                with self.assertRaises(websockets.ConnectionClosed):
                    await browser.recv()
                self.assertEqual(browser.close_code, 1000)

    async def test_decisions_are_shown_with_their_reasons_to_the_operator_only(self):
        with Machine("80") as busy, Machine("97") as full, SessionServer([busy.address, full.address],
                                                                          loadThreshold=95) as session:
            wait_until(lambda: 'webots_servers{state="up"} 2' in server_states(session), "both are up")
            self.assertEqual(session.get("/session"), f"ws://{busy.address}")
            status, told = session.command("--decisions")
            self.assertEqual(status, 0, told)
            self.assertRegex(told, f"WHEN +SENT TO +ITS LOAD +OFFERED +NOT OFFERED\\n[0-9]+ s ago +{busy.address} +80% +1 +load 1\\n")
            status, told = session.command("--decisions", "--json")
            self.assertEqual(status, 0, told)
            last = json.loads(told)["decisions"][0]
            self.assertEqual((last["chosen"], last["policy"]), (busy.address, "least_committed"))
            self.assertEqual([machine.get("refused") for machine in last["machines"]], [None, "load"])
            self.assertEqual(session.ask("/api/decisions")[0], 404, "who is on this machine is not the operator for it")
            self.assertIsNotNone(session.get("/livez", {"X-Forwarded-For": "203.0.113.7"}))

    async def test_the_order_of_starting_does_not_matter(self):
        before = Machine()
        late_port = free_port()
        with before, SessionServer([before.address, f"127.0.0.1:{late_port}"]) as session:
            wait_until(lambda: {'webots_servers{state="up"} 1', 'webots_servers{state="down"} 1'} <= set(server_states(session)),
                       "one is up, the late one is down")
            self.assertEqual(session.get("/"), "1")
            with Machine(port=late_port):
                wait_until(lambda: 'webots_servers{state="up"} 2' in server_states(session), "the late one is up")
        self.assertGreater(len(before.polls), 1)

    async def test_connections_are_kept_where_the_peer_allows(self):
        with Machine() as kept, Machine(keep_alive=False) as closing, SessionServer([kept.address, closing.address]) as session:
            wait_until(lambda: len(kept.polls) > 3 and len(closing.polls) > 3, "polls")
            self.assertLessEqual(len({client for client, _ in kept.polls[:]}), 2, "one, and one for the list of worlds beside it")
            polls = closing.polls[:]  # there may be one more at any time
            self.assertEqual(len({client for client, _ in polls}), len(polls))
            self.assertEqual(kept.polls[0][1]["Accept"], "application/json, text/plain;q=0.5")
            self.assertIn('webots_servers{state="up"} 2', server_states(session))

    async def test_nonsense_is_no_load(self):
        with Machine("10") as machine, SessionServer([machine.address], loadRefresh=0.1) as session:
            for nonsense in ("", "abc", "nan", "-1", "9" * 100_000):
                machine.load = "10"
                wait_until(lambda: session.get("/") == "1", "up")
                machine.load = nonsense
                wait_until(lambda: session.get("/") == "0", f"{nonsense[:10]!r} counts as a load")
            machine.status = 500
            machine.load = "10"
            polls = len(machine.polls)
            wait_until(lambda: len(machine.polls) > polls + 2, "two answers with 500")  # the first may have begun as nonsense
            self.assertEqual(session.get("/"), "0")
            self.assertIn('webots_servers{state="down"} 1', server_states(session))

    async def test_sighup_takes_new_servers_and_keeps_browsers(self):
        with Machine() as first, Machine() as second, SessionServer([first.address]) as session:
            wait_until(lambda: session.get("/") == "1", "up")
            async with websockets.connect(f"ws://localhost:{session.port}/") as browser:
                self.assertEqual(await browser.recv(), "1")
                path = os.path.join(session.folder, "config.json")
                with open(path, "w") as file:
                    json.dump({**session.config, "simulationServers": [second.address]}, file)
                session.process.send_signal(signal.SIGHUP)
                wait_until(lambda: session.get("/session") == f"ws://{second.address}", "the second one is used")
                with open(path, "w") as file:
                    file.write("{")
                session.process.send_signal(signal.SIGHUP)
                wait_until(lambda: "The configuration stays as it was" in session.log(), "the bad file is refused")
                self.assertEqual(session.get("/session"), f"ws://{second.address}")
                await browser.ping()

    async def test_sighup_takes_over_what_it_can_and_names_what_needs_a_restart(self):
        with Machine("60") as machine, CompletionQueue() as first, CompletionQueue() as second, \
                SessionServer([machine.address], loadThreshold=50, administrator="a@example.org", mailServer="localhost",
                              mailServerPort=first.port, mailSender="s@example.org") as session:
            wait_until(lambda: first.mails, "it is full")
            self.assertEqual(session.get("/"), "0")
            async with websockets.connect(f"ws://localhost:{session.port}/") as browser:
                self.assertEqual(await browser.recv(), "0")
                session.reread(loadThreshold=70, mailServerPort=second.port, logDir="elsewhere", scheduling="random", placementTimeout=30,
                               decisionsForAll=True)
                self.assertEqual(await asyncio.wait_for(browser.recv(), 30), "1")
            keys = "These keys have changed, and take effect at the next start: placementTimeout, logDir\n"
            wait_until(lambda: "The configuration was read again" in session.log() and keys in session.log(), "the log lines")
            self.assertEqual(session.get("/session"), f"ws://{machine.address}")
            self.assertEqual(json.loads(session.get("/api/decisions"))["decisions"][0]["policy"], "random")
            machine.load = "99"
            wait_until(lambda: second.mails, "a mail through the other server")
            self.assertEqual(len(first.mails), 1)
            session.reread(administrator="", mailServerPort=second.port)
            wait_until(lambda: session.log().count("The configuration was read again") == 2, "read once more")
            machine.load = "1"
            wait_until(lambda: "simulation server is available again (load = 1.0%)" in session.log(), "logged, not mailed")
            self.assertEqual(len(second.mails), 1)

    async def test_sigterm_closes_sockets_with_1001_and_exits_with_0(self):
        with Machine() as machine, SessionServer([machine.address]) as session:
            async with websockets.connect(f"ws://localhost:{session.port}/") as browser:
                await browser.recv()
                self.assertEqual(await asyncio.to_thread(session.stop), 0)
                with self.assertRaises(websockets.ConnectionClosed):
                    while True:
                        await asyncio.wait_for(browser.recv(), 30)
                self.assertEqual(browser.close_code, 1001)

    def test_no_connection_waits_until_the_kernel_has_made_room_for_more_descriptors(self):
        with SessionServer([]) as session, open(f"/proc/{session.process.pid}/status") as status:
            room = int(re.search(r"^FDSize:\s*(\d+)$", status.read(), re.MULTILINE)[1])
        self.assertGreaterEqual(room, min(65536, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))

    async def test_the_log_is_a_file_in_the_format_operators_know(self):
        with Machine() as machine, SessionServer([machine.address], debug=False, logDir="logs") as session:
            wait_until(lambda: session.get("/") == "1", "up")
            session.get("/nope")
            self.assertIsNone(session.get("/no%0Ape"))
            with open(os.path.join(session.folder, "logs", "session", "output.log")) as file:
                def lines():
                    file.seek(0)
                    return file.read().splitlines()
                moment = r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} "
                for pattern in (r"\[INFO   \]  Session server running on port \d+$", r"\[WARNING\]  404 GET /nope \(127\.0\.0\.1\)$",
                                r"\[WARNING\]  404 GET /no%0Ape \(127\.0\.0\.1\)$"):
                    # The log is written by another thread: an answer may come before its line.
                    wait_until(lambda: any(re.match(moment + pattern, line) for line in lines()), lambda: f"{pattern} in {lines()}")

    def test_a_log_file_that_can_not_be_written_is_one_sentence_and_status_2(self):
        server = SessionServer(["localhost:1"], debug=False, logDir="/proc/nowhere")
        self.addCleanup(server.close)
        with self.assertRaises(AssertionError) as raised:
            server.start()
        lines = str(raised.exception).strip().splitlines()[1:]
        self.assertEqual(len(lines), 1, lines)
        self.assertIn("Log file /proc/nowhere/session/output.log cannot be created: ", lines[0])
        self.assertEqual(server.process.returncode, 2)

    def test_a_log_on_a_full_disk_goes_to_standard_error_until_there_is_room(self):
        server = SessionServer([], debug=False)
        self.addCleanup(server.close)
        folder = os.path.join(server.folder, "log")
        path = os.path.join(folder, "session", "output.log")
        os.makedirs(folder)
        mount_small_disk(self, folder, "64k,nr_inodes=1")
        server.start()
        complaint = "Log file log/session/output.log cannot be written: No space left on device. Until it can, its lines go to standard error."
        wait_until(lambda: "Session server running" in server.log(), "no log on standard error")
        self.assertEqual(server.log().count(complaint), 1)
        subprocess.run(["mount", "-o", "remount,size=64k,nr_inodes=10", folder], check=True)
        server.get("/nope")
        wait_until(lambda: "404 GET /nope " in read(path), lambda: f"the log is no file again: {server.log()}")
        self.assertIn("Lines are missing here, and went to standard error: No space left on device\n", read(path))
        with contextlib.suppress(OSError), open(os.path.join(folder, "filler"), "wb", buffering=0) as filler:
            while True:
                filler.write(bytes(4096))
        server.reread(**{"x" * 50 + str(i): 0 for i in range(100)})  # a page of its own is not full yet
        wait_until(lambda: "The configuration was read again" in server.log(), "lines on standard error")
        self.assertEqual(server.log().count(complaint), 2)
        self.assertIsNotNone(server.get("/load"))

    def test_a_log_file_that_is_a_pipe_is_set_aside(self):
        server = SessionServer([], debug=False)
        self.addCleanup(server.close)
        folder = os.path.join(server.folder, "log", "session")
        os.makedirs(folder)
        os.mkfifo(os.path.join(folder, "output.log"))
        server.start()
        # The log is written by another thread: the first line may come after the first answer.
        wait_until(lambda: "is now output.log.set-aside-" in read(os.path.join(folder, "output.log")), "the log says so")
        self.assertTrue(any("set-aside" in name for name in os.listdir(folder)), os.listdir(folder))

    def test_the_log_as_json_is_an_object_a_line(self):
        for arguments, keys in (([], {"logFormat": "json"}), (["--log-format", "json"], {}),
                                (["--log-format=json"], {"logFormat": "text"})):
            with self.subTest(arguments=arguments, keys=keys):
                server = SessionServer([], debug=False, logDir="logs", **keys)
                server.arguments = arguments
                with server:
                    folder = os.path.join(server.folder, "logs", "session")
                    self.check_json_log(os.path.join(folder, "output.log"), server.port)

    def check_json_log(self, path, port):
        with open(path) as file:
            lines = wait_until(lambda: (file.seek(0), [line for line in file.readlines() if "running on port" in line])[1], "the log is empty")
        entry = json.loads(lines[0])
        self.assertRegex(entry.pop("time"), r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
        self.assertEqual(entry, {"level": "info", "message": f"Session server running on port {port}"})

    def test_the_log_rotates_at_500000_bytes_and_every_line_of_json_stays_whole(self):
        with SessionServer([], debug=False, logDir="logs", logFormat="json") as session:
            folder = os.path.join(session.folder, "logs", "session")
            path = os.path.join(folder, "output.log.1")
            # Lines without a limit: those that clients cause have one, see log_flood_test.py.
            session.configure(**{"x" * 50 + str(i): 0 for i in range(1000)})

            def fill():
                before = self.count_of_lines(folder)
                session.process.send_signal(signal.SIGHUP)
                wait_until(lambda: self.count_of_lines(folder) >= before + 1001, "the configuration is read again")
                return os.path.exists(path)
            wait_until(fill, "an old file")
            self.assertLessEqual(os.path.getsize(path), 500_000)
            with open(path) as file:
                levels = [json.loads(line)["level"] for line in file]
            self.assertEqual(set(levels[1:]), {"warning", "info"})
            self.assertGreater(levels.count("warning"), 2000)

    def count_of_lines(self, folder):
        counts = {}  # by file: one may get another name meanwhile, and would be counted twice
        for name in os.listdir(folder):
            with contextlib.suppress(FileNotFoundError), open(os.path.join(folder, name), "rb") as file:
                counts[os.fstat(file.fileno()).st_ino] = file.read().count(b"\n")
        return sum(counts.values())


class Programs(unittest.TestCase):
    def run_program(self, *arguments):
        with tempfile.TemporaryDirectory() as folder:
            finished = subprocess.run([program("webots-session-server"), *arguments], capture_output=True, text=True, timeout=30,
                                      cwd=folder)
        return finished.returncode, finished.stdout, finished.stderr

    def test_help_and_version(self):
        status, text, _ = self.run_program("--help")
        self.assertEqual(status, 0)
        self.assertIn("config/session/local.json", text)
        status, text, _ = self.run_program("--version")
        self.assertRegex(text, r"^webots-session-server \d+\.\d+\.\d+$")

    def test_whoever_starts_it_in_a_terminal_is_told_where_its_log_is(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "c.json"), "w") as file:
                json.dump({"port": free_port(), "simulationServers": ["localhost:1"], "logDir": "logs", "server": "localhost"}, file)
            ours, terminal = os.openpty()
            server = subprocess.Popen([program("webots-session-server"), "c.json"], cwd=folder, stdin=terminal, stdout=terminal, stderr=terminal)
            os.close(terminal)
            self.addCleanup(os.close, ours)
            try:
                told = b""
                while b"Ctrl-C" not in told and select.select([ours], [], [], 30)[0]:
                    told += os.read(ours, 4096)
            finally:
                server.terminate()
                server.wait(30)
            self.assertIn(b"webots-session-server: What it does is logged to logs/session/output.log. Ctrl-C ends it.", told)

    def test_wrong_arguments_and_missing_files_are_one_sentence_and_status_2(self):
        for arguments, sentence in ((["--nope"], "unrecognised option '--nope'"), (["a.json", "b.json"], "Too many arguments."),
                                    (["--log-format", "xml"], '--log-format: expected text or json, found "xml"'),
                                    (["/nonexistent/c.json"], "/nonexistent/c.json: the configuration can't be read: "),
                                    (["/"], "expected a configuration file, found a folder")):
            status, _, text = self.run_program(*arguments)
            self.assertEqual(status, 2, arguments)
            self.assertIn(sentence, text)
            self.assertEqual(text.count("\n"), 1, text)

    def test_a_configuration_that_is_no_file_or_endless_is_refused_and_not_waited_for(self):
        with tempfile.TemporaryDirectory() as folder:
            pipe, large = os.path.join(folder, "pipe"), os.path.join(folder, "large")
            os.mkfifo(pipe)
            with open(large, "wb") as file:
                file.truncate(1 << 40)
            for path, why in ((pipe, "it is no regular file"), ("/dev/zero", "it is no regular file"),
                              (large, "it is larger than 1048576 bytes")):
                status, _, text = self.run_program(path)
                self.assertEqual(status, 2, path)
                self.assertEqual(text, f"webots-session-server: {path}: the configuration can't be read: {why}\n")


if __name__ == "__main__":
    main()
