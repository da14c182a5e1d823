#!/usr/bin/python3
"""The simulation server as a process, with the demo simulator and its faults. Protocol sections 4, 6 and 8."""

import asyncio
import json
import os
import signal
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, Browser, server  # noqa: E402
from support.servers import is_alive, main, port_is_free, program, wait_until  # noqa: E402


class Starts(unittest.IsolatedAsyncioTestCase):
    async def test_the_happy_path_is_two_frames(self):
        with server() as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(browser.told, ["shutdownTimeout: 7200", f"webots:ws://localhost:{simulation.port + 1}"])
                report = json.loads(simulation.get("/load", {"Accept": "application/json"}))
                self.assertEqual((report["sessions"], report["starting"], report["capacity"]), (1, 0, 20))
                self.assertIn("arena.wbt", simulation.get("/monitor"))
                self.assertIn("is not Webots", simulation.get("/monitor"))
            simulation.wait_until_clean()
            self.assertTrue(port_is_free(simulation.port + 1))

    async def test_every_stream_mode_starts(self):
        with server() as simulation:
            for mode in ("mjpeg", "x3d", "w3d", ""):
                with self.subTest(mode):
                    async with Browser(simulation) as browser:
                        await browser.start(mode=mode)
                        await browser.hear("webots:")
            simulation.wait_until_clean()

    async def test_failures_are_told_and_the_socket_is_closed(self):
        cases = {
            '{"start":{"url":"%s"}}' % WORLD.replace("arena", "nowhere"): "loading: Error: nowhere.wbt does not exist.",
            '{"start":{"url":"https://example.org/x"}}': "loading: Error: Unsupported URL protocol: ",
            '{"start":{"url":"local:/other/robots/blob/main/worlds/a.wbt"}}': "loading: Error: Docker not enabled: ",
            '{"start":{"url":"local:/demo_projects/$(touch x)/blob/main/worlds/a.wbt"}}': "loading: Error: Wrong Webots simulation URL",
            "{": "loading: Error: Wrong message: ", "": "loading: Error: Wrong message: ",
            "null": "loading: Error: Wrong message: ", "5": "loading: Error: Wrong message: ",
            '{"start":{}}': "loading: Error: Wrong message: ", '{"start":{"url":5}}': "loading: Error: Wrong message: ",
            "[" * 10_000: "loading: Error: Wrong message: ",
        }
        with server() as simulation:
            for message, answer in cases.items():
                with self.subTest(message[:60]):
                    async with Browser(simulation) as browser:
                        await browser.socket.send(message)
                        code = await browser.hear_all()
                        self.assertEqual(len(browser.told), 1, browser.told)
                        self.assertTrue(browser.told[0].startswith(answer), browser.told)
                        self.assertEqual(code, 1005)  # an empty close frame, as ever
            simulation.wait_until_clean()

    async def test_messages_beyond_reason_close_with_the_code_for_it(self):
        with server() as simulation:
            for message, expected in ((b"\xff\xfe", None), ("x" * 1_000_000, 1009)):
                async with Browser(simulation) as browser:
                    await browser.socket.send(message)
                    code = await browser.hear_all()
                    if expected:
                        self.assertEqual(code, expected)
                    else:
                        self.assertTrue(browser.told[0].startswith("loading: Error: Wrong message: "))
            self.assertIsNotNone(simulation.get("/load"))

    async def test_many_at_once_get_ports_of_their_own(self):
        with server(maxConnections=8) as simulation:
            browsers = [Browser(simulation) for _ in range(9)]
            for browser in browsers:
                await browser.__aenter__()
            for browser in browsers[:8]:
                await browser.start()
            answers = await asyncio.gather(*(browser.hear("webots:") for browser in browsers[:8]))
            self.assertEqual(len(set(answers)), 8)
            await browsers[8].start()
            self.assertIn("Too many open connections (>8)", await browsers[8].hear("loading: Error:"))
            for browser in browsers:
                await browser.__aexit__()
            simulation.wait_until_clean()


class Faults(unittest.IsolatedAsyncioTestCase):
    """Whatever the simulator does, the browser is told, and nothing outlives it."""

    async def ends_with(self, faults, answer, **settings):
        with server(faults=faults, **settings) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear_all()
                self.assertIn(answer, browser.told[-1])
            simulation.wait_until_clean()

    async def leaves_nothing(self, faults, ready=True):
        with server(faults=faults) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:" if ready else "shutdownTimeout:")
                processes = simulation.simulators()
            simulation.wait_until_clean()
            self.assertFalse([pid for pid in processes if is_alive(pid)])

    async def test_exit_before_ready(self):
        await self.ends_with("exit-before-ready=3", "Unable to start Webots: it exited with status 3 before the world was loaded")

    async def test_crash_before_ready(self):
        await self.ends_with("crash-before-ready", "Unable to start Webots: it was ended by signal 11")

    async def test_exit_after_ready(self):
        await self.ends_with("exit-after-ready=200", "Webots has quit.")

    async def test_crash_after_ready(self):
        await self.ends_with("crash-after-ready=200", "Webots has quit unexpectedly: it was ended by signal 11.")

    async def test_never_ready(self):
        await self.ends_with("never-ready", "Webots did not load the world within 1 s.", startTimeout=1)

    async def test_a_port_that_nobody_was_given_is_not_announced(self):
        await self.ends_with("wrong-port", "Webots loaded the world but opened no port within 1 s.", startTimeout=1)

    async def test_hanging_and_ignoring_sigterm(self):
        await self.leaves_nothing("ignore-sigterm")
        await self.leaves_nothing("never-ready,ignore-sigterm", ready=False)

    async def test_grandchildren_that_flee_with_setsid(self):
        await self.leaves_nothing("grandchild,daemon-grandchild")

    async def test_output_of_every_kind(self):
        for fault in ("flood", "long-lines", "binary-lines"):
            with self.subTest(fault):
                await self.leaves_nothing(fault)

    async def test_what_a_dead_simulator_leaves_behind_is_killed(self):
        await self.ends_with("daemon-grandchild,exit-after-ready=200", "Webots has quit.")


class Ends(unittest.IsolatedAsyncioTestCase):
    async def test_sigterm_ends_simulations_closes_sockets_with_1001_and_exits_with_0(self):
        with server(faults="ignore-sigterm,daemon-grandchild") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                processes = simulation.simulators()
                status = await asyncio.to_thread(simulation.stop)
                self.assertEqual(status, 0, simulation.log())
                self.assertEqual(await browser.hear_all(), 1001)
                self.assertFalse([pid for pid in processes if is_alive(pid)])
                self.assertEqual(simulation.instances(), [])

    async def test_sigkill_leaves_no_process_and_the_next_start_no_directory(self):
        with server(faults="ignore-sigterm,daemon-grandchild") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                processes = simulation.simulators()
                self.assertGreaterEqual(len(processes), 3)
                await asyncio.to_thread(simulation.stop, signal.SIGKILL)
                wait_until(lambda: not [pid for pid in processes if is_alive(pid)], "orphans live on")
            self.assertEqual(len(simulation.instances()), 1)
            simulation.start()
            self.assertEqual(simulation.instances(), [])
            self.assertIn("Removed 1 left-over", simulation.log())


class Configuration(unittest.TestCase):
    def complaint(self, config, *arguments):
        """Standard error and exit status of a server that can't start."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "c.json")
            with open(path, "w") as file:
                file.write(config if isinstance(config, str) else json.dumps(config))
            finished = subprocess.run([program("webots-simulation-server"), path, *arguments], capture_output=True, text=True,
                                      timeout=30, cwd=folder, env={**os.environ, "TMPDIR": folder, "HOME": folder})
            return finished.stderr.replace(folder, ""), finished.returncode

    def test_a_bad_configuration_is_one_sentence_and_status_2(self):
        for config, sentence in (("{", "/c.json: not JSON: "), ({"port": "abc"}, 'key "port": expected an integer from 1 to 65534, '
                                                                                  'found the string "abc"')):
            text, status = self.complaint(config)
            self.assertEqual(status, 2)
            self.assertIn(sentence, text)
            self.assertEqual(text.count("\n"), 1)

    def test_check_config_reads_and_stops(self):
        text, status = self.complaint({"prot": 2000}, "--check-config")
        self.assertEqual(status, 0)
        self.assertIn('unknown key "prot" is ignored; did you mean "port"?', text)

    def test_a_port_in_use_is_said(self):
        with server() as first:
            text, status = self.complaint({"port": first.port, "debug": True})
            self.assertEqual(status, 2)
            self.assertIn("Is a server running there already?", text)

    def test_too_many_arguments(self):
        text, status = self.complaint({}, "another.json")
        self.assertEqual(status, 2)
        self.assertIn("Too many arguments.", text)


if __name__ == "__main__":
    main()
