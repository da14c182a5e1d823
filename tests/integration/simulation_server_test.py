#!/usr/bin/python3
"""The simulation server as a process, with the demo simulator and its faults. Protocol sections 4, 6, 8, 11 and 13."""

import asyncio
import contextlib
import functools
import json
import os
import shlex
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, Browser, server  # noqa: E402
from support.raw_websocket import answer_to, close_code, frame  # noqa: E402
from support.refusals import error_line, error_pattern  # noqa: E402
from support.registry import Registry  # noqa: E402
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
        with server(timeout=400) as simulation:
            for mode in ("mjpeg", "x3d", "w3d", ""):
                with self.subTest(mode):
                    async with Browser(simulation) as browser:
                        await browser.start(mode=mode)
                        await browser.hear("webots:")
                        self.assertEqual(browser.told[0], "shutdownTimeout: 400")  # 8.2 timeout
            simulation.wait_until_clean()

    # 6.1: simulators run in other folders than the server.
    async def test_a_relative_folder_of_webots_starts_at_the_folder_of_the_server(self):
        for setting, environment in (({"webotsHome": "wh"}, {}), ({}, {"WEBOTS_HOME": "wh"})):
            simulation = server(environment=environment, **setting)
            with self.subTest(setting), contextlib.closing(simulation):
                os.mkdir(os.path.join(simulation.folder, "wh"))
                os.symlink(program("webots-demo-simulator"), os.path.join(simulation.folder, "wh", "webots"))
                simulation.start()
                async with Browser(simulation) as browser:
                    await browser.start()
                    await browser.hear("webots:")
                self.assertIn(os.path.join(simulation.folder, "wh", "webots"), simulation.log())
                simulation.wait_until_clean()

    # 4.2: session servers place by it.
    async def test_the_load_tells_what_the_machine_can_run_and_what_its_worlds_use(self):
        simulation = server(webotsHome="wh", labels=["gpu"])
        with contextlib.closing(simulation):
            os.makedirs(os.path.join(simulation.folder, "wh", "resources"))
            os.symlink(program("webots-demo-simulator"), os.path.join(simulation.folder, "wh", "webots"))
            with open(os.path.join(simulation.folder, "wh", "resources", "version.txt"), "w") as file:
                file.write("R2025a\n")
            simulation.start()
            ask = functools.partial(simulation.get, "/load", {"Accept": "application/json"})
            self.assertEqual(json.loads(ask())["labels"], ["gpu", "R2025a"])
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                wait_until(lambda: any(use["running"] for use in json.loads(ask())["worlds"]), "the simulation is not measured")
                report = json.loads(ask())
                self.assertEqual(report["processors"], os.cpu_count())
                self.assertEqual([(use["running"], use["starting"]) for use in report["worlds"]], [(1, 0)])
                self.assertGreater(report["worlds"][0]["memory"], 0)
                self.assertNotIn("arena", ask(), "everybody may read it")
            wait_until(lambda: json.loads(ask())["worlds"] == [], "a world is reported that nobody runs")
            simulation.wait_until_clean()

    # 4.1.1: malformed messages; 4.1.2 steps 2, 3, 5 and 8, 4.1.3: the sentences; 4.1.4: the close.
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

    def test_people_who_open_the_root_are_led_to_the_monitor(self):
        with server() as simulation:
            self.assertEqual(simulation.ask("/"), (200, "1"), "programs")
            status, page = simulation.ask("/", headers={"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"})
            self.assertEqual(status, 200)
            self.assertEqual(page, simulation.ask("/monitor", headers={"Accept": "text/html"})[1])

    def test_messages_without_end_are_not_kept(self):
        hundred_megabytes = struct.pack("!BBQ", 0x81, 0xff, 100_000_000) + b"\0\0\0\0" + b"x" * 1_000_000
        endless_fragments = frame(0x01, b"") + frame(0x00, b"") * 100_000
        with server() as simulation:
            answer_to(simulation, "/client", frame(0x88, b""))
            before, _, _ = simulation.figures()
            for _ in range(5):
                for data in (hundred_megabytes, endless_fragments):
                    self.assertEqual(close_code(answer_to(simulation, "/client", data)), 1009)
            if not simulation.is_sanitized():
                self.assertLess(simulation.figures()[0], before + 4_000, "kilobytes of memory")

    # 4.3, Q9.
    async def test_a_port_that_somebody_else_has_is_passed_over(self):
        with server() as simulation, socket.create_server(("", simulation.port + 1)):
            async with Browser(simulation) as browser:
                await browser.start()
                self.assertEqual(await browser.hear("webots:"), f"webots:ws://localhost:{simulation.port + 2}")
                self.assertIn(f"Port {simulation.port + 1} is already in use.\n", simulation.log())
                self.assertIn(f" --port={simulation.port + 2} ", simulation.log())  # Webots would look for another one by itself

    # 4.3, Q9.
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
    """Whatever the simulator does, the browser gets a message, and no process survives. Section 6.5, quirks Q7, Q10 and Q15."""

    async def ends_with(self, faults, answer, **settings):
        with server(faults=faults, **settings) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear_all()
                self.assertRegex(browser.told[-1], answer)
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
        await self.ends_with("exit-before-ready=3", error_pattern("ended_early_saying", how="it exited with status 3"))

    async def test_crash_before_ready(self):
        await self.ends_with("crash-before-ready", error_pattern("ended_early_saying", how="it was ended by signal 11"))

    async def test_exit_after_ready(self):
        await self.ends_with("exit-after-ready=200", error_pattern("quit"))

    async def test_crash_after_ready(self):
        await self.ends_with("crash-after-ready=200", error_pattern("crashed", how="it was ended by signal 11"))

    async def test_never_ready(self):
        await self.ends_with("never-ready", error_pattern("not_loaded", seconds=1), startTimeout=1)

    async def test_a_port_that_nobody_was_given_is_not_announced(self):
        await self.ends_with("wrong-port", error_pattern("no_port", seconds=1), startTimeout=1)

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
        await self.ends_with("daemon-grandchild,exit-after-ready=200", error_pattern("quit"))


class Programs(unittest.IsolatedAsyncioTestCase):
    """Which simulator is run, and with which environment. Sections 6.1 and 8.2 (`webotsHome`, `DISPLAY`), quirk Q15."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.home = folder.name
        self.webots = os.path.join(self.home, "webots")
        self.install(f"#!/bin/sh\nenv >{self.home}/environment\nexec {shlex.quote(program('webots-demo-simulator'))} \"$@\"\n")

    def install(self, content):
        """Makes an executable for a fake Webots."""
        with open(self.webots, "w") as file:
            file.write(content)
        os.chmod(self.webots, 0o755)

    def programs(self):
        """A PATH without Xvfb."""
        folder = os.path.join(self.home, "bin")
        os.mkdir(folder)
        os.symlink("/usr/bin/env", os.path.join(folder, "env"))
        return folder

    async def environment_of_a_start(self, **settings):
        """The environment of the simulator, as a dictionary; the simulator must be this Webots."""
        with server(**settings) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
            self.assertRegex(simulation.log(), rf'Webots \[\d+\] started: "{self.webots} --batch ')
        with open(os.path.join(self.home, "environment")) as file:
            return dict(line.split("=", 1) for line in file.read().splitlines() if "=" in line)

    async def test_the_webots_of_the_configuration_runs_with_nothing_of_the_operators_secrets(self):
        around = await self.environment_of_a_start(webotsHome=self.home, environment={"DISPLAY": "", "PASSWORD": "secret", "PATH": self.programs()})
        self.assertEqual(around.get("DISPLAY"), ":0")  # without Xvfb
        self.assertNotIn("PASSWORD", around)

    async def test_the_webots_of_the_environment_runs_on_the_display_of_the_environment(self):
        around = await self.environment_of_a_start(environment={"WEBOTS_HOME": self.home, "DISPLAY": ":7"})
        self.assertEqual(around.get("DISPLAY"), ":7")

    # Each release of Webots knows either "x3d" or "w3d", and exits when given the other; quirk Q22.
    async def test_no_webots_is_told_a_word_that_it_does_not_know_and_none_draws_what_the_browser_draws(self):
        stand_in = (f'#!/bin/sh\nfor option; do case $option in --stream=x3d|--stream=w3d) echo "webots: invalid value" >&2; exit 1;; esac; done\n'
                    f'echo "$@" >>{self.home}/arguments\nexec {shlex.quote(program("webots-demo-simulator"))} "$@"\n')
        self.install(stand_in)
        with server(webotsHome=self.home) as simulation:
            for mode in ("", "x3d", "w3d", "mjpeg"):
                async with Browser(simulation) as browser:
                    await browser.start(mode=mode)
                    await browser.hear("webots:")
        with open(os.path.join(self.home, "arguments")) as file:
            lines = file.read().splitlines()
        for line in lines[:3]:
            self.assertRegex(line, r"^--batch --mode=pause --minimize --no-rendering --port=\d+ --heartbeat=5000 --stream /")
        self.assertRegex(lines[3], r"^--batch --mode=pause --port=\d+ --heartbeat=5000 --stream=mjpeg /")

    def test_a_webots_that_is_named_and_is_not_there_is_refused_before_anything_starts(self):
        nowhere = os.path.join(self.home, "nowhere")
        empty = os.path.join(self.home, "empty")
        os.mkdir(empty)
        unusable = os.path.join(self.home, "unusable")
        os.makedirs(os.path.join(unusable, "webots"))
        for home in (nowhere, empty, unusable):
            for settings, environment, what in (({"webotsHome": home}, {}, 'key "webotsHome"'),
                                                ({}, {"WEBOTS_HOME": home}, "WEBOTS_HOME of the environment")):
                simulation = server(environment=environment, **settings)
                with self.subTest(home=home, what=what), contextlib.closing(simulation):
                    path = simulation.configure()
                    status, said = simulation.command("--check-config")
                    self.assertEqual(status, 2, said)
                    self.assertRegex(said, f"{path}:[0-9:]* {what}: {home}/webots is missing or not executable. ")
                    self.assertEqual(simulation.command(), (status, said))  # a start
        with contextlib.closing(server(webotsHome=self.home, environment={"WEBOTS_HOME": nowhere})) as simulation:
            simulation.configure()
            self.assertEqual(simulation.command("--check-config")[0], 0)

    async def test_a_webots_that_has_gone_or_is_no_program_is_told_and_the_next_start_tries_again(self):
        with server(webotsHome=self.home) as simulation:
            os.rename(self.webots, self.webots + ".old")
            async with Browser(simulation) as browser:
                await browser.start()
                self.assertEqual(await browser.hear_all(), 1005)
                self.assertEqual(browser.told, [error_line("not_started", why=f"{self.webots} can't be run: No such file or directory")])
            self.install("#!/nowhere/interpreter\n")
            async with Browser(simulation) as browser:
                await browser.start()
                self.assertEqual(await browser.hear_all(), 1005)
                self.assertEqual(browser.told[1:], [error_line("ended_early_saying", how="it exited with status 127",
                                                               words=f"can't run {self.webots}: No such file or directory")])
            simulation.wait_until_clean()
            os.rename(self.webots + ".old", self.webots)
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")


class Ends(unittest.IsolatedAsyncioTestCase):
    """Section 6.5, quirk Q11."""

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

    async def test_sigterm_tells_a_browser_whose_simulation_has_not_started(self):
        with server(faults="never-ready") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("shutdownTimeout:")
                await asyncio.to_thread(simulation.stop)
                self.assertEqual(await browser.hear_all(), 1001)
                self.assertEqual(browser.told[-1], "loading: Error: This simulation server is being stopped. Please start again.")

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

    async def test_servers_beside_each_other_touch_nothing_of_each_other(self):
        with server() as first, server(stateDir=first.state_folder()) as second:
            async with Browser(first) as visitor, Browser(second) as browser:
                await visitor.start()
                await visitor.hear("webots:")
                processes, instances = sorted(first.simulators()), first.instances()
                await browser.start()
                await browser.hear("webots:")
                await asyncio.to_thread(second.stop, signal.SIGKILL)
                await asyncio.to_thread(second.start)
                self.assertIn("Removed 1 left-over", second.log())
                self.assertEqual((sorted(first.simulators()), first.instances()), (processes, instances))
                await asyncio.wait_for(await visitor.socket.ping(), 60)

    def test_a_server_does_not_start_where_the_directories_are_anothers(self):
        with server() as first:
            again = subprocess.run([program("webots-simulation-server"), first.configure()], capture_output=True, text=True, timeout=60,
                                   env={**os.environ, "XDG_STATE_HOME": os.path.dirname(first.state_folder())})
            self.assertIn(f"no simulation server on port {first.port}: ", again.stderr)
            self.assertIn("another simulation server uses it; is one running already?\n", again.stderr)
            self.assertEqual(again.returncode, 3)  # systemd tries again, and then the other may have ended


class Operations(unittest.IsolatedAsyncioTestCase):
    """The operator's requests to a running server. Section 8.2 at SIGHUP, section 13 `/api/drain` and `/readyz`."""

    async def start(self, simulation):
        """The last message of a start: an address, or why there is none."""
        async with Browser(simulation) as browser:
            await browser.start()
            return await browser.hear(("webots:", "loading: Error: "))

    async def test_sighup_takes_over_what_it_can_and_a_running_simulation_goes_on(self):
        def broken_configuration():
            with open(os.path.join(simulation.folder, "config.json"), "w") as file:
                file.write("{")
            simulation.process.send_signal(signal.SIGHUP)

        with server() as simulation:
            async with Browser(simulation) as visitor:
                await visitor.start()
                await visitor.hear("webots:")
                processes = sorted(simulation.simulators())
                simulation.reread(allowedRepositories=[], title="Lab 7", port=simulation.port + 1)
                wait_until(lambda: "These keys have changed, and take effect at the next start: port\n" in simulation.log(), "read again")
                self.assertIn("The configuration was read again. Applied: allowedRepositories, title\n", simulation.log())
                self.assertTrue((await self.start(simulation)).startswith("loading: Error: Docker not enabled: "))
                broken_configuration()
                wait_until(lambda: "The configuration stays as it was: " in simulation.log(), "the broken file is named")
                self.assertIn("<h1>Lab 7</h1>", simulation.get("/monitor"))
                await asyncio.wait_for(await visitor.socket.ping(), 60)
                self.assertEqual(sorted(simulation.simulators()), processes)

    async def test_a_draining_server_refuses_until_it_is_told_otherwise_and_ends_with_the_last_simulation_if_asked_to(self):
        refusal = "loading: Error: This simulation server is about to stop. Please start again on another one."
        with server() as simulation:
            simulation.process.send_signal(signal.SIGUSR1)
            wait_until(lambda: simulation.ask("/readyz") == (503, "draining"), "it does not drain")
            self.assertEqual(await self.start(simulation), refusal)
            self.assertIs(json.loads(simulation.get("/load", {"Accept": "application/json"}))["draining"], True)
            self.assertEqual(simulation.ask("/api/drain?off", "POST")[0], 404)
            self.assertEqual(simulation.ask("/readyz"), (503, "draining"))
            self.assertEqual(simulation.command("--resume"), (0, "serving"))
            self.assertEqual(simulation.ask("/readyz"), (200, "ready"))
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(simulation.command("--drain-and-exit"), (0, "draining"))
                self.assertEqual(await self.start(simulation), refusal)
                self.assertIsNone(simulation.process.poll())
                await asyncio.wait_for(await browser.socket.ping(), 60)
            self.assertEqual(await asyncio.to_thread(simulation.process.wait, 60), 0)
            self.assertEqual(simulation.instances(), [])


class Registration(unittest.IsolatedAsyncioTestCase):
    """Section 11, quirk Q16."""

    async def test_each_registry_is_told_and_one_that_never_answers_is_in_nobodys_way(self):
        settings = {"server": "localhost", "ssl": True, "portRewrite": True, "shareIdleTime": 12.5,
                    "allowedRepositories": ["https://github.com/cyberbotics", "local:/demo_projects"]}
        with Registry(silent=True) as silent, Registry() as registry, server(notify=[silent.url, registry.url], **settings) as simulation:
            wait_until(lambda: f"Registered at {registry.url}: welcome\n" in simulation.log(), "it does not register")
            wait_until(lambda: silent.forms, "it does not ask the other one")
            self.assertEqual(registry.forms, [{"url": [f"https://localhost/{simulation.port}"], "shareIdleTime": ["12.5"],
                                               "allowedRepositories": ["https://github.com/cyberbotics,local:/demo_projects"]}])
            self.assertEqual(silent.forms[0], registry.forms[0])
            async with Browser(simulation) as browser:
                await browser.start()
                self.assertEqual(await browser.hear("webots:"), f"webots:wss://localhost/{simulation.port + 1}")
            simulation.wait_until_clean()
            self.assertEqual(simulation.stop(), 0)

    async def test_what_sighup_changes_is_told_again_and_only_that(self):
        with Registry(status=201) as registry, server(notify=registry.url, shareIdleTime=50, allowedRepositories=[]) as simulation:
            wait_until(lambda: registry.forms, "it does not register")
            simulation.reread(title="Lab 7")
            wait_until(lambda: "The configuration was read again" in simulation.log(), "SIGHUP is not heard")
            simulation.reread(shareIdleTime=12.5, allowedRepositories=["https://github.com/a", "https://github.com/b"])
            wait_until(lambda: len(registry.forms) > 1, "it does not register again")
            self.assertEqual([(form["shareIdleTime"], form["allowedRepositories"]) for form in registry.forms],
                             [(["50"], [""]), (["12.5"], ["https://github.com/a,https://github.com/b"])])


class Configuration(unittest.TestCase):
    def complaint(self, config, *arguments):
        """Standard error and exit status of a server that can't start."""
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "c.json")
            with open(path, "w") as file:
                file.write(config if isinstance(config, str) else json.dumps(config))
            finished = subprocess.run([program("webots-simulation-server"), os.path.basename(path), *arguments], capture_output=True, text=True,
                                      timeout=30, cwd=folder, env={**os.environ, "TMPDIR": folder, "HOME": folder})
            return finished.stderr.replace(folder, ""), finished.returncode

    def test_a_bad_configuration_is_one_sentence_and_status_2(self):
        for config, sentence in (("{", "c.json:1:2: not JSON: "), ({"port": "abc"}, 'key "port": expected an integer from 1 to 65534, '
                                                                                  'found the string "abc"')):
            text, status = self.complaint(config)
            self.assertEqual(status, 2)
            self.assertIn(sentence, text)
            self.assertEqual(text.count("\n"), 1)

    def test_check_config_reads_and_stops(self):
        text, status = self.complaint({"prot": 2000}, "--check-config")
        self.assertEqual(status, 0)
        self.assertIn('unknown key "prot" is ignored; did you mean "port"?', text)

    def test_check_config_looks_at_the_files_that_the_configuration_names(self):
        with tempfile.TemporaryDirectory() as folder:
            for settings, sentence in (
                    ({"sslCertificate": "/nope.pem", "sslKey": "/nope.pem"},
                     "the certificate /nope.pem can't be used: No such file or directory"),
                    ({"sslCertificate": "/etc/passwd", "sslKey": "/nope.pem"},
                     "the certificate /etc/passwd can't be used: expected a PEM file with \"-----BEGIN CERTIFICATE-----\""),
                    ({"docker": True}, "no simulation can start, since there is no docker-compose-default.yml in /docker. "),
                    ({"docker": True, "dockerDir": folder}, f"no docker-compose-default.yml in {folder}. Set \"dockerDir\"")):
                text, status = self.complaint({"server": "h", **settings}, "--check-config")
                self.assertEqual((status, text.count("\n")), (2, 1), text)
                self.assertIn(sentence, text)

    def test_a_forge_in_a_folder_that_is_not_there_is_warned_of(self):
        text, status = self.complaint({"server": "h", "forges": [{"url": "local:", "directory": "nowhere"}]}, "--check-config")
        self.assertEqual(status, 0)
        self.assertIn("there is no folder /nowhere: no world of local: can be fetched\n", text)

    def test_a_port_in_use_is_said_and_worth_another_try(self):
        with server() as first:
            text, status = self.complaint({"port": first.port, "debug": True})
            self.assertEqual(status, 3)  # systemd tries it again, other than 2
            self.assertIn("Is a server running there already?", text)

    def test_too_many_arguments(self):
        text, status = self.complaint({}, "another.json")
        self.assertEqual(status, 2)
        self.assertIn("Too many arguments.", text)


if __name__ == "__main__":
    main()
