#!/usr/bin/python3
"""One log file per simulation: what it holds, how large it gets, when it is removed. Protocol section 9.1."""

import contextlib
import os
import re
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import Browser, server  # noqa: E402
from support.servers import main, wait_until  # noqa: E402

DAY = 86400


def folder(simulation):
    return os.path.join(simulation.folder, "log", "simulation", "simulations")


def logs(simulation):
    return sorted(os.listdir(folder(simulation))) if os.path.isdir(folder(simulation)) else []


def text_of(simulation, name):
    with open(os.path.join(folder(simulation), name), "rb") as file:
        return file.read()


def printed(simulation):
    """How many bytes the simulator has written."""
    counts = [0]
    for process in simulation.simulators():
        with contextlib.suppress(OSError), open(f"/proc/{process}/io") as file:
            counts.append(int(re.search(r"^wchar: (\d+)$", file.read(), re.MULTILINE)[1]))
    return max(counts)


class MainLog(unittest.TestCase):
    """Section 8.2 `logDir` and `debug`."""

    def output_log(self, simulation):
        return os.path.join(simulation.folder, "log", "simulation", "output.log")

    def test_it_is_a_file_in_the_format_operators_know_and_nothing_is_on_the_terminal(self):
        with server(debug=False) as simulation:
            line = re.compile(r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} "
                              rf"\[INFO   \]  Running simulation server on port {simulation.port}$", re.MULTILINE)
            with open(self.output_log(simulation)) as file:
                wait_until(lambda: (file.seek(0), line.search(file.read()))[1], "the line is missing")
            simulation.stop()
            self.assertEqual(simulation.log(), "")

    def test_for_debugging_it_is_on_the_terminal_and_there_is_no_file(self):
        with server(debug=True) as simulation:
            wait_until(lambda: f"Running simulation server on port {simulation.port}\n" in simulation.log(), "the line is missing")
            self.assertFalse(os.path.exists(self.output_log(simulation)))


class SimulationLogs(unittest.IsolatedAsyncioTestCase):
    async def test_each_simulation_has_a_file_that_the_main_log_and_the_monitor_name(self):
        with server() as simulation:
            for _ in range(2):
                async with Browser(simulation) as browser:
                    await browser.start()
                    await browser.hear("webots:")
                    last = logs(simulation)[-1]
                    wait_until(lambda: last in simulation.get("/monitor"), "the page does not name it")  # made once a second
                    self.assertIn(f"What Webots prints is in {last}", simulation.log())
                simulation.wait_until_clean()
            self.assertEqual(len(logs(simulation)), 2)
            for name in logs(simulation):
                wait_until(lambda: b"demo simulator" in text_of(simulation, name), "nothing is in the log")
                self.assertIn(b"  Output of local:/demo_projects/robots/", text_of(simulation, name))

    async def test_a_flood_stays_small_and_is_counted(self):
        with server(faults="flood") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                # Far more than is passed on, of which the server has read most.
                wait_until(lambda: printed(simulation) > 2_000_000, "there is no flood")
            simulation.wait_until_clean()
            wait_until(lambda: b" left out: more than 500 a second were printed]" in text_of(simulation, logs(simulation)[0]), "no end was written")
            self.assertLess(len(text_of(simulation, logs(simulation)[0])), 600_000)

    async def test_bytes_that_steer_terminals_are_made_harmless(self):
        with server(faults="binary-lines") as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
            simulation.wait_until_clean()
            wait_until(lambda: b"\\x1b" in text_of(simulation, logs(simulation)[0]), "the line is missing")
            self.assertNotIn(b"\x1b", text_of(simulation, logs(simulation)[0]))

    async def test_old_logs_go_at_the_start_and_nothing_else_does(self):
        with server(simulationLogDays=2) as simulation:
            simulation.stop()
            os.makedirs(folder(simulation), exist_ok=True)
            for name, age in (("2026-01-31_13-59-59_7.log", 3), ("2026-01-31_13-59-59_8.log", 1), ("notes.log", 300)):
                path = os.path.join(folder(simulation), name)
                with open(path, "w"):
                    pass
                os.utime(path, (time.time() - age * DAY,) * 2)
            simulation.start()
            wait_until(lambda: logs(simulation) == ["2026-01-31_13-59-59_8.log", "notes.log"], f"still there: {logs(simulation)}")

    async def test_without_days_nothing_is_written(self):
        with server(simulationLogDays=0) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
            simulation.wait_until_clean()
            self.assertEqual(logs(simulation), [])

    async def test_a_folder_that_cannot_be_written_costs_a_line_and_no_simulation(self):
        with server(logDir="/proc/nowhere", monitorLogEnabled=False) as simulation:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
            wait_until(lambda: "Simulation log /proc/nowhere/simulation/simulations/" in simulation.log(), "no complaint")
            simulation.wait_until_clean()


if __name__ == "__main__":
    main()
