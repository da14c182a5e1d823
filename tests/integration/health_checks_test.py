#!/usr/bin/python3
"""Health checks as proxies send them: a real HAProxy with its own check, and the spellings of probes. Protocol section 13.6."""

import os
import socket
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import haproxy  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402

CHECKS = {"": "its own", "HEAD /": "the first page", "OPTIONS *": "no path", "GET /readyz/": "a slash at the end", "HEAD /livez": "the documented one"}


class HealthChecks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.simulation = cls.enterClassContext(SimulationServer())
        cls.session = cls.enterClassContext(SessionServer([cls.simulation.address]))
        wait_until(lambda: cls.session.get("/") == "1", "no machine is up")
        cls.servers = (cls.session, cls.simulation)

    def test_haproxy_keeps_the_servers_whatever_it_asks(self):
        for server in self.servers:
            for check, what in CHECKS.items():
                with self.subTest(server.PROGRAM, check=what), haproxy.health(free_port(), server.port, check) as look:
                    wait_until(lambda: look()[1] not in ("", "L4OK"), lambda: f"no check: {look()}")
                    self.assertEqual(look(), ("UP", "L7OK"))

    def test_options_name_the_methods_also_without_a_host(self):
        for server in self.servers:
            for target in ("/", "*"):
                with self.subTest(server.PROGRAM, target=target), socket.create_connection(("localhost", server.port), PATIENCE) as connection:
                    connection.sendall(f"OPTIONS {target} HTTP/1.0\r\n\r\n".encode())
                    head = connection.makefile("rb").read().decode().split("\r\n")
                    self.assertEqual(head[0].split()[1], "204")
                    self.assertIn("Allow: GET, HEAD, OPTIONS, POST", head)

    def test_a_slash_at_the_end_of_a_probe_changes_nothing(self):
        for server in self.servers:
            for path in ("/livez", "/readyz"):
                self.assertEqual(server.ask(path + "/"), server.ask(path), f"{server.PROGRAM} {path}")
                self.assertEqual(server.ask(path + "/")[0], 200)


if __name__ == "__main__":
    main()
