#!/usr/bin/python3
"""monitor.csv of the simulation server. Protocol section 9.2."""

import os
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.disks import mount_small_disk  # noqa: E402
from support.servers import SimulationServer, main, wait_until  # noqa: E402

HEADER = ("Timestamp, Webots running, Webots idle, CPU load, CPU memory, GPU load compute, GPU load memory, GPU memory, Swap, Disk, "
          "Network sent, Network received")


def csv(server):
    return os.path.join(server.folder, "log", "simulation", "monitor.csv")


def lines(server):
    try:
        with open(csv(server)) as file:
            return file.read().split("\n")
    except FileNotFoundError:
        return []


class MonitorLog(unittest.TestCase):
    def test_a_line_a_second_after_the_heading(self):
        with SimulationServer() as server:
            wait_until(lambda: len(lines(server)) >= 6, "no lines come")
            head, *rows, rest = lines(server)
            self.assertEqual(head, HEADER)
            self.assertEqual(rest, "")  # whole lines only
            stamps = [int(row.split(", ")[0]) for row in rows]
            self.assertEqual(stamps, sorted(set(stamps)), "a second has two lines")
            for row in rows:
                fields = row.split(", ")
                self.assertEqual(len(fields), 12, row)
                self.assertEqual(fields[1:3], ["0", "0"])
                for percent in fields[3:10]:
                    self.assertRegex(percent, r"^\d+\.\d$")
                    self.assertTrue(0 <= float(percent) <= 100, row)
                for rate in fields[10:]:
                    self.assertRegex(rate, r"^\d+\.\d{1,3}$")
            self.assertGreater(float(rows[-1].split(", ")[4]), 0)  # some memory is always in use
            self.assertGreater(float(rows[-1].split(", ")[9]), 0)

    def test_it_begins_anew_at_every_start(self):
        with SimulationServer() as server:
            wait_until(lambda: len(lines(server)) >= 4, "no lines come")
            first = lines(server)[1]
            server.stop()
            server.start()
            wait_until(lambda: len(lines(server)) >= 3, "no lines come")
            self.assertEqual(lines(server)[0], HEADER)
            self.assertNotIn(first, lines(server))

    def test_it_can_be_switched_off(self):
        with SimulationServer(monitorLogEnabled=False) as server:
            wait_until(lambda: server.get("/load"), "no answer")
            self.assertFalse(os.path.exists(csv(server)))
            self.assertNotIn("unknown key", server.log())

    def test_a_file_that_cant_be_written_costs_one_line_and_nothing_else(self):
        with SimulationServer(logDir="/proc/nowhere") as server:
            wait_until(lambda: "Monitor log file /proc/nowhere/simulation/monitor.csv cannot be created: " in server.log(), "no complaint")
            self.assertIsNotNone(server.get("/load"))
            self.assertEqual(server.log().count("Monitor log file"), 1)

    def test_a_full_disk_costs_one_line_and_nothing_else(self):
        server = SimulationServer()
        os.makedirs(os.path.dirname(csv(server)))
        mount_small_disk(self, os.path.dirname(csv(server)), "4k")
        with open(os.path.join(os.path.dirname(csv(server)), "filler"), "wb") as file:
            file.write(bytes(4096))
        with server:
            wait_until(lambda: "monitor.csv cannot be written: No space left on device" in server.log(), "no complaint")
            self.assertIsNotNone(server.get("/load"))
            self.assertEqual(server.log().count("Monitor log file"), 1)


if __name__ == "__main__":
    main()
