#!/usr/bin/python3
"""Starts, stops, faults and kills in every order: afterwards no process, no directory and no port is left, and the server is as
small as before. Protocol sections 4.1.4, 6.5 and quirks Q7, Q10, Q11, Q14.

    torture_test.py            as ctest runs it, within a minute
    torture_test.py --long     1,000 random sequences and 10,000 cycles: an hour or two
    TORTURE_SEED=7 torture_test.py   the same random numbers again
"""

import asyncio
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import WORLD, Browser, server  # noqa: E402
from support.servers import SimulationServer, descendants, main, port_is_free, wait_until  # noqa: E402

try:
    from support import web_sockets as websockets
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-websockets)") or 77)

LONG = "--long" in sys.argv
if LONG:
    sys.argv.remove("--long")
SEED = int(os.environ.get("TORTURE_SEED", random.randrange(1_000_000)))
AT_ONCE = 32
SEQUENCES = 1000 if LONG else 64
KILLS = 50 if LONG else 4
CYCLES = 10_000 if LONG else 120

NAMESPACES = subprocess.run(["unshare", "--pid", "--fork", *([] if os.geteuid() == 0 else ["--user"]), "true"],
                            stderr=subprocess.DEVNULL).returncode == 0

FAULTS = ["", "never-ready", "ready-delay=300", "exit-before-ready=3", "exit-after-ready=100", "crash-before-ready",
          "crash-after-ready=100", "hang=50", "ignore-sigterm", "grandchild", "daemon-grandchild", "flood", "wrong-port",
          "long-lines", "binary-lines", "no-final-newline", "refuse-w3d,refuse-x3d", "ignore-sigterm,grandchild,daemon-grandchild"]


def processes_of(simulation):
    """Everything that this server's simulations started, also when the server is dead: the instance path is in every command line."""
    mark = simulation.instances_folder().encode()
    found = []
    for entry in os.listdir("/proc"):
        if entry.isdigit():
            with contextlib.suppress(OSError), open(f"/proc/{entry}/cmdline", "rb") as line, open(f"/proc/{entry}/stat") as stat:
                if mark in line.read() and stat.read().rpartition(")")[2].split()[0] not in "ZX":
                    found.append(int(entry))
    return found


def is_guard(pid):
    with contextlib.suppress(OSError), open(f"/proc/{pid}/comm") as name:
        return name.read().strip() == "webots-process-"
    return False


def kill_somehow(pid, dice):
    """Faults of a simulator. It can't kill its guard; the operator can, where a namespace ends the simulator with its guard."""
    if not is_guard(pid):
        os.kill(pid, dice.choice((signal.SIGKILL, signal.SIGTERM, signal.SIGSTOP, signal.SIGSEGV)))
    elif NAMESPACES:
        os.kill(pid, dice.choice((signal.SIGKILL, signal.SIGSTOP)))
    else:
        os.kill(pid, signal.SIGSTOP)


def check_clean(simulation):
    wait_until(lambda: not processes_of(simulation), f"processes are left\n{simulation.log()[-4000:]}")
    simulation.wait_until_clean()
    for port in range(simulation.port + 1, simulation.port + 1 + simulation.config["maxConnections"]):
        wait_until(lambda: port_is_free(port), f"port {port} is held")


async def hear_end_or(browser, beginning):
    """Waits for a message, or for the server to close."""
    with contextlib.suppress(websockets.ConnectionClosed):
        await browser.hear(beginning)


class EachFaultAtEachMoment(unittest.IsolatedAsyncioTestCase):
    async def leave_before_ready(self, simulation):
        async with Browser(simulation) as browser:
            await browser.start()
            await hear_end_or(browser, "shutdownTimeout:")

    async def leave_after_ready_or_failure(self, simulation):
        async with Browser(simulation) as browser:
            await browser.start()
            await hear_end_or(browser, "webots:")
            await asyncio.sleep(random.uniform(0, 0.2))  # from before the fault to after it

    async def lose_the_connection(self, simulation):
        async with Browser(simulation) as browser:
            await browser.start()
            await asyncio.sleep(random.uniform(0, 0.3))
            browser.socket.transport.abort()

    async def test_nothing_is_left(self):
        for fault in FAULTS:
            with self.subTest(fault=fault, seed=SEED), server(faults=fault, startTimeout=1) as simulation:
                await asyncio.gather(self.leave_before_ready(simulation), self.leave_after_ready_or_failure(simulation),
                                     self.lose_the_connection(simulation))
                check_clean(simulation)

    async def test_nothing_is_left_when_the_server_stops_during_the_close(self):
        for fault in FAULTS:
            with self.subTest(fault=fault, seed=SEED), server(faults=fault, startTimeout=1) as simulation:
                async with Browser(simulation) as browser:
                    await browser.start()
                    await hear_end_or(browser, "shutdownTimeout:")
                await asyncio.sleep(random.uniform(0, 0.05))
                status = await asyncio.to_thread(simulation.stop)
                self.assertEqual(status, 0, simulation.log()[-4000:])
                self.assertEqual(processes_of(simulation), [])
                self.assertEqual(simulation.instances(), [])


class Storm(unittest.IsolatedAsyncioTestCase):
    """Random sequences of actions, many at once."""

    async def one(self, simulation, dice):
        with contextlib.suppress(websockets.ConnectionClosed, OSError, asyncio.TimeoutError):
            async with Browser(simulation) as browser:
                for _ in range(dice.randrange(1, 5)):
                    await self.step(simulation, browser, dice)
                if dice.random() < 0.3:
                    browser.socket.transport.abort()

    async def step(self, simulation, browser, dice):
        action = dice.choice(("start", "start", "garbage", "reset", "hear", "pause", "kill"))
        if action == "start":
            await browser.start(WORLD if dice.random() < 0.9 else WORLD + ".wbt", dice.choice(("mjpeg", "w3d", "", "nonsense")))
        elif action == "garbage":
            await browser.socket.send(dice.choice(("{", "{}", "[]", '{"start":{}}', '{"reconnect":"x"}', "x" * 5000)))
        elif action == "reset":
            await browser.socket.send('{"reset controller":"avoid_walls/avoid_walls.py"}')
        elif action == "hear":
            await asyncio.wait_for(browser.socket.recv(), 1)
        elif action == "pause":
            await asyncio.sleep(dice.uniform(0, 0.3))
        else:
            victims = processes_of(simulation)
            with contextlib.suppress(ProcessLookupError):
                if victims:
                    kill_somehow(dice.choice(victims), dice)

    async def run_storm(self, faults, sequences):
        dice = random.Random(SEED)
        with server(faults=faults, maxConnections=AT_ONCE, reconnectGrace=dice.choice((0, 0.2)), startTimeout=5) as simulation:
            left = sequences
            turns = asyncio.Semaphore(AT_ONCE)

            async def turn(seed):
                async with turns:
                    await self.one(simulation, random.Random(seed))

            await asyncio.gather(*(turn(dice.random()) for _ in range(left)))
            check_clean(simulation)
            self.assertIsNotNone(simulation.get("/load"))
            self.assertIn('webots_simulations{state="idle"} 0\n', simulation.get("/metrics"))
            self.assertEqual(simulation.stop(), 0, simulation.log()[-4000:])

    async def test_of_healthy_simulators(self):
        await self.run_storm("", SEQUENCES // 2)

    async def test_of_stubborn_ones_with_children(self):
        await self.run_storm("ignore-sigterm,grandchild,daemon-grandchild", SEQUENCES // 2)


class KilledServer(unittest.IsolatedAsyncioTestCase):
    async def keep_starting(self, simulation):
        while self.starting:
            with contextlib.suppress(websockets.WebSocketException, OSError, asyncio.TimeoutError, EOFError):
                async with Browser(simulation) as browser:
                    await browser.start()
                    await asyncio.wait_for(browser.hear("webots:"), 0.3)

    async def test_whenever_it_is_killed_no_process_survives_and_the_next_start_cleans_up(self):
        dice = random.Random(SEED)
        with server(faults="ignore-sigterm,daemon-grandchild") as simulation:
            for _ in range(KILLS):
                self.starting = True
                browsers = [asyncio.create_task(self.keep_starting(simulation)) for _ in range(8)]
                await asyncio.sleep(dice.uniform(0, 0.8))
                self.starting = False
                await asyncio.to_thread(simulation.stop, signal.SIGKILL)
                await asyncio.gather(*browsers)
                wait_until(lambda: not processes_of(simulation), f"orphans live on (seed {SEED})")
                await asyncio.to_thread(simulation.start)
                self.assertEqual(simulation.instances(), [], f"seed {SEED}")
            check_clean(simulation)


class StoppedGuard(unittest.IsolatedAsyncioTestCase):
    """The guards of a running simulation have received SIGSTOP."""

    async def stop_guards(self, simulation, browser):
        await browser.start()
        await browser.hear("webots:")
        guards = [pid for pid in simulation.simulators() if is_guard(pid)]
        self.assertTrue(guards)
        for guard in guards:
            os.kill(guard, signal.SIGSTOP)

    async def test_it_ends_its_simulation_when_the_browser_leaves(self):
        with server() as simulation:
            async with Browser(simulation) as browser:
                await self.stop_guards(simulation, browser)
            check_clean(simulation)

    async def test_it_ends_its_simulation_when_the_server_is_killed(self):
        with server() as simulation:
            async with Browser(simulation) as browser:
                await self.stop_guards(simulation, browser)
                simulation.process.kill()
                wait_until(lambda: not processes_of(simulation), "processes are left")


class LoadMeanwhile(unittest.IsolatedAsyncioTestCase):
    """/load is answered while others fetch and start: the event loop never blocks. Protocol section 4.2, quirk Q4."""

    def ask(self, simulation, times):
        """Asks for the load this many times; returns the reports, and prints how long the answers took."""
        reports, took = [], []
        for _ in range(times):
            began = time.perf_counter()
            reports.append(json.loads(simulation.get("/load", {"Accept": "application/json"})))
            took.append(1000 * (time.perf_counter() - began))
        took.sort()
        print(f"/load: median {took[len(took) // 2]:.1f} ms, 99 % {took[len(took) * 99 // 100]:.1f} ms")
        return reports

    async def test_of_a_forge_that_never_answers(self):
        kept = []  # connections that nobody keeps are closed
        forge = await asyncio.start_server(lambda *connection: kept.append(connection), "127.0.0.1", 0)
        url = "http://127.0.0.1:%d" % forge.sockets[0].getsockname()[1]
        with SimulationServer(forges=[url], allowedRepositories=[url], maxConnections=AT_ONCE) as simulation:
            async with contextlib.AsyncExitStack() as browsers:
                for _ in range(AT_ONCE):
                    browser = await browsers.enter_async_context(Browser(simulation))
                    await browser.start(f"{url}/o/r/blob/main/worlds/a.wbt")
                wait_until(lambda: f'webots_simulations{{state="starting"}} {AT_ONCE}\n' in simulation.get("/metrics"), "they do not start")
                reports = await asyncio.to_thread(self.ask, simulation, 200)
                self.assertEqual({(report["sessions"], report["starting"]) for report in reports}, {(AT_ONCE, AT_ONCE)})
            check_clean(simulation)
        forge.close()

    async def test_of_simulations_that_start_and_end(self):
        async def start_again_and_again(simulation):
            while self.starting:
                async with Browser(simulation) as browser:
                    await browser.start()
                    await browser.hear("webots:")

        with server(maxConnections=AT_ONCE) as simulation:
            self.starting = True
            browsers = [asyncio.create_task(start_again_and_again(simulation)) for _ in range(AT_ONCE // 2)]
            reports = await asyncio.to_thread(self.ask, simulation, 200)
            self.starting = False
            await asyncio.gather(*browsers)
            self.assertEqual(len(reports), 200)
            check_clean(simulation)


class Soak(unittest.IsolatedAsyncioTestCase):
    async def cycle(self, simulation, count, at_once=4):
        async def some():
            for _ in range(count // at_once):
                async with Browser(simulation) as browser:
                    await browser.start()
                    await browser.hear("webots:")

        await asyncio.gather(*(some() for _ in range(at_once)))
        check_clean(simulation)

    async def test_memory_threads_and_descriptors_stay_flat(self):
        with server() as simulation:
            await self.cycle(simulation, max(40, CYCLES // 10))
            memory, threads, descriptors = simulation.figures()
            await self.cycle(simulation, CYCLES)
            if not simulation.is_sanitized():
                self.assertLess(simulation.figures()[0], memory + 8_000, "kilobytes of memory")
            wait_until(lambda: simulation.figures()[1:] == (threads, descriptors),
                       f"threads and descriptors: {simulation.figures()[1:]} after {(threads, descriptors)}")
            self.assertEqual(descendants(simulation.process.pid), [])


if __name__ == "__main__":
    print("seed", SEED)
    random.seed(SEED)
    main()
