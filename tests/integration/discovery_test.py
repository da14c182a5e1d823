#!/usr/bin/python3
"""Machines that are found by name, with a real name server (dnsmasq), and machines that announce themselves. docs/discovery.md."""

import base64
import contextlib
import hashlib
import hmac
import json
import os
import re
import secrets
import signal
import struct
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.parse
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.machine import Machine  # noqa: E402
from support.name_server import BadNameServer, NameServer  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import SessionServer, SimulationServer, main, wait_until  # noqa: E402


def machines(session):
    """What the monitor page says: address -> how it was found."""
    shown = json.loads(session.get("/monitor", {"Accept": "application/json"}))
    return {server["address"]: server.get("foundBy", "") for server in shown["servers"]}


def loads(session):
    shown = json.loads(session.get("/monitor", {"Accept": "application/json"}))
    return {server["address"]: server["load"] for server in shown["servers"]}


def discovering(entries, name_server, **config):
    return SessionServer(entries, nameServers=[name_server.address], discoverLoopback=True, **config)


class Names(unittest.TestCase):
    def test_machines_vanish_and_return_at_another_address(self):
        port = free_port()
        entry = f"dns:sim.test:{port}"
        with contextlib.ExitStack() as stack:
            first, second, moved = (stack.enter_context(Machine(port=port, host=f"127.0.0.{number}")) for number in (2, 3, 4))
            names = stack.enter_context(NameServer({"sim": ["127.0.0.2", "127.0.0.3"]}))
            session = stack.enter_context(discovering([entry, "127.0.0.1:9"], names))
            wait_until(lambda: loads(session).get(first.address) is not None and loads(session).get(second.address) is not None,
                       "both are found and polled")
            self.assertEqual(machines(session), {first.address: entry, second.address: entry, "127.0.0.1:9": ""})
            self.assertIn(f'"foundBy":"{entry}"', session.get("/monitor"))
            self.assertIn(session.get("/session"), [f"ws://{first.address}", f"ws://{second.address}"])
            names.tell(sim=["127.0.0.3", "127.0.0.4"])
            wait_until(lambda: set(machines(session)) == {second.address, moved.address, "127.0.0.1:9"}, "one has moved")
            self.assertIn("1 added, 0 removed", session.log())
            self.assertIn("0 added, 1 removed", session.log())

    def test_services_have_spares(self):
        ports = [free_port(), free_port()]
        with contextlib.ExitStack() as stack:
            spare = stack.enter_context(Machine("1", port=ports[1], host="127.0.0.1"))
            first = stack.enter_context(Machine("50", port=ports[0], host="127.0.0.1"))
            names = stack.enter_context(NameServer(services=[f"_webots._tcp.test,localhost,{ports[0]},10,1",
                                                             f"_webots._tcp.test,localhost,{ports[1]},20,1"]))
            session = stack.enter_context(discovering(["srv:_webots._tcp.test"], names))
            wait_until(lambda: session.get("/") == "1", "one is up")
            self.assertEqual(session.get("/session"), f"ws://localhost:{ports[0]}", "though the spare has less to do")
            first.status = 500
            wait_until(lambda: session.get("/session") == f"ws://localhost:{ports[1]}", "the spare is used")
            first.status = 200
            wait_until(lambda: session.get("/session") == f"ws://localhost:{ports[0]}", "the first is back")
            self.assertEqual(spare.status, 200)

    def test_a_name_server_that_lies_or_answers_thousands_of_addresses(self):
        port = free_port()
        crowd = [f"127.7.{i // 250}.{i % 250 + 1}" for i in range(4000)]
        with Machine(port=port, host="127.0.0.2") as good, \
                NameServer({"lie": ["169.254.169.254", "224.0.0.1", "0.0.0.0", "127.0.0.2"], "crowd": crowd}) as names, \
                discovering([f"dns:lie.test:{port}", "dns:crowd.test:9"], names) as session:
            wait_until(lambda: session.get("/") == "1", "the machine behind the lie is used")
            wait_until(lambda: len(machines(session)) == 1001, "the others are limited")
            self.assertEqual(machines(session)[good.address], f"dns:lie.test:{port}")
            self.assertIn(f"dns:lie.test:{port}: 3 of its answers are no addresses of machines", session.log())
            self.assertIn("dns:crowd.test:9: it names 4000 machines, of which 1000 are used", session.log())
            self.assertEqual(session.get("/session"), f"ws://{good.address}")

    def test_loopback_addresses_are_no_machines_unless_the_operator_says_so(self):
        with NameServer({"sim": ["127.0.0.2"]}) as names, \
                SessionServer(["dns:sim.test:2000", "a.example.org:1"], nameServers=[names.address]) as session:
            wait_until(lambda: 'see "discoverLoopback"' in session.log(), "it is said")
            self.assertEqual(set(machines(session)), {"a.example.org:1"})

    def test_a_name_server_that_hangs_or_answers_garbage_delays_nothing(self):
        def cut_off(question):
            return question[:2] + struct.pack(">HHHHH", 0x8180, 1, 3, 0, 0) + question[12:]
        with Machine() as machine:
            for bad in (BadNameServer(), BadNameServer(lambda question: os.urandom(40)), BadNameServer(cut_off)):
                with bad, discovering(["dns:sim.test:2000", "srv:_webots._tcp.test", machine.address], bad) as session:
                    wait_until(lambda: bad.questions >= 2, "it is asked")
                    wait_until(lambda: session.get("/") == "1", "the other machine is used")
                    self.assertEqual(session.get("/session"), f"ws://{machine.address}")
                    self.assertEqual(set(machines(session)), {machine.address})


class Announcements(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_announcements_"))
        self.secret = secrets.token_hex(32)
        self.file = self.write_secret("secret", self.secret)

    def write_secret(self, name, word):
        path = os.path.join(self.folder, name)
        with open(path, "w") as file:
            file.write(word + "\n")
        os.chmod(path, 0o600)
        return path

    def listening(self, **config):
        return SessionServer([], announcements=True, discoverLoopback=True, sessionSecret=self.file, **config)

    def announce(self, session, machine, at=None, more="", secret=None, to=None):
        """Written from docs/protocol.md, not from our code. The status. `to`: for whom, if not for whoever answers."""
        if to is None:
            to = self.receiver(session, secret)
        return self.post(session, machine, at, f"&to={to}{more}", secret)[0]

    def receiver(self, session, secret=None):
        told = re.search(r"to=([\w-]+)$", self.post(session, "a.example.org:1", None, "", secret)[1])
        return told[1] if told else "nobody"

    def post(self, session, machine, at, more, secret=None):
        """The status, and the body."""
        query = f"machine={urllib.parse.quote(machine, safe='')}&at={int(1000 * (at or time.time()))}{more}"
        code = hmac.new((secret or self.secret).encode(), b"webots_cloud announcement 1\n" + query.encode(), hashlib.sha256).digest()
        headers = {"Authorization": "Webots-Cloud " + base64.urlsafe_b64encode(code).decode().rstrip("=")}
        try:
            with urllib.request.urlopen(urllib.request.Request(f"{session.url}/api/machines?{query}", b"", headers)) as answer:
                return answer.status, answer.read().decode()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.read().decode()

    def test_a_simulation_server_is_known_says_goodbye_and_comes_back(self):
        with self.listening() as session:
            config = {"sessionServers": [session.url + "/"], "sessionSecret": self.file}
            with SimulationServer(**config) as simulation:
                wait_until(lambda: machines(session) == {simulation.address: "announced"}, "it announces itself")
                wait_until(lambda: session.get("/") == "1", "it answers polls")
                self.assertTrue(session.get("/session").startswith(f"ws://{simulation.address}/ticket/"))
            wait_until(lambda: machines(session) == {}, "it says goodbye", 10)
            self.assertIn("says goodbye", session.log())
            with SimulationServer(port=simulation.port, **config) as simulation:
                wait_until(lambda: machines(session) == {simulation.address: "announced"}, "it comes back")
                simulation.process.send_signal(signal.SIGKILL)
                simulation.process.wait()
                wait_until(lambda: session.get("/") == "0", "it answers no poll")
                wait_until(lambda: machines(session) == {}, "it is forgotten", 45)
            self.assertIn("no longer announces itself, and is forgotten", session.log())

    def test_only_who_knows_the_secret_is_heard_and_nothing_is_heard_twice(self):
        with self.listening() as session:
            self.assertEqual(self.announce(session, "a.example.org:1", secret="another secret"), 403)
            self.assertEqual(self.announce(session, "dns:a:1"), 403)
            now = time.time()
            self.assertEqual(self.announce(session, "a.example.org:1", now), 200)
            self.assertEqual(self.announce(session, "a.example.org:1", now), 409)
            self.assertEqual(self.announce(session, "a.example.org:1", now + 1, "&goodbye"), 200)
            self.assertEqual(self.announce(session, "a.example.org:1", now), 409)
            self.assertEqual(self.announce(session, "a.example.org:1", now - 300), 409)
            self.assertEqual(self.announce(session, "a.example.org:1", now + 2), 200)
            self.assertEqual(self.announce(session, "a.example.org:1", now + 1, "&goodbye"), 409)
            wait_until(lambda: set(machines(session)) == {"a.example.org:1"}, "the machine is known")
            other = self.write_secret("other", secrets.token_hex(32))
            with SimulationServer(sessionServers=[session.url], sessionSecret=other) as simulation:
                wait_until(lambda: "HTTP 403: This announcement is not signed" in simulation.log(), "its operator is told")
            self.assertIn("it is not signed with our \"sessionSecret\"", session.log())
            self.assertEqual(set(machines(session)), {"a.example.org:1"})

    def test_what_was_said_to_another_session_server_or_before_a_restart_counts_for_nothing(self):
        with self.listening() as one, self.listening() as other:
            now = time.time()
            to = self.receiver(one)
            self.assertNotEqual(to, self.receiver(other))
            self.assertEqual(self.announce(other, "a.example.org:1", now, to=to), 421)
            self.assertEqual(self.announce(one, "a.example.org:1", now, to=to), 200)
            one.stop()
            one.start()
            self.assertEqual(self.announce(one, "a.example.org:1", now, to=to), 421)
            self.assertEqual(set(machines(one)) | set(machines(other)), set())

    def test_both_keys_need_the_secret(self):
        for server, key in ((SessionServer([], announcements=True), "announcements"),
                            (SimulationServer(sessionServers=["http://localhost:1"]), "sessionServers")):
            with self.assertRaisesRegex(AssertionError, f'"sessionSecret".*{key}'):
                try:
                    server.start()
                finally:
                    server.close()

    def test_without_the_key_nobody_is_heard(self):
        with SessionServer([], sessionSecret=self.file) as session:
            self.assertEqual(self.announce(session, "a.example.org:1"), 404)


if __name__ == "__main__":
    main()
