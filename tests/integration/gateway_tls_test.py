#!/usr/bin/python3
"""A site over two machines: between the session server and its simulation servers, TLS.

The second machine is a network namespace at the other end of a cable, on which everything is recorded.
"""

import asyncio
import contextlib
import http.server
import json
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
import threading

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from session_gateway_test import Site  # noqa: E402
from support import own_network  # noqa: E402
from support.browser_client import LOCAL  # noqa: E402
from support.certificates import Authority, self_signed  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.served import Served  # noqa: E402
from support.servers import SimulationServer, main, wait_until  # noqa: E402

CONFIG = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "config")
MACHINE = "sim2.campus.internal"
WORLD_FILE = b"#VRML_SIM"  # how the file begins that browsers read
TOLD = b"scene load completed"  # what a simulation says to its browser
PICTURES = b"multipart/x-mixed-replace"


def name_machine(folder):
    """Gives the second machine its name, in our mount namespace alone."""
    with open("/etc/hosts") as known:
        text = known.read()
    with open(os.path.join(folder, "hosts"), "w") as hosts:
        hosts.write(f"{text}\n{own_network.PRIVATE} {MACHINE}\n")
    subprocess.run(["mount", "--bind", hosts.name, "/etc/hosts"], check=True)


class Wire:
    """Everything that passes through the cable."""

    def __enter__(self):
        self.recorded = bytearray()
        self.socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))  # every protocol
        self.socket.bind(("cable", 0))
        self.socket.settimeout(0.1)
        self.is_over = False
        self.thread = threading.Thread(target=self._record)
        self.thread.start()
        return self

    def _record(self):
        while not self.is_over:
            with contextlib.suppress(TimeoutError):
                self.recorded += self.socket.recv(1 << 16)

    def __exit__(self, *_):
        self.is_over = True
        self.thread.join()
        self.socket.close()


class There(SimulationServer):
    """On the other machine."""

    def __init__(self, outside, **settings):
        super().__init__(**settings)
        self.wrapper = ("nsenter", "-t", str(outside.process.pid), "-n", "--")
        self.url = self.url.replace("localhost", own_network.PRIVATE)


class TwoMachines(Site):
    @classmethod
    def setUpClass(cls):
        cls.outside = cls.enterClassContext(own_network.Outside())

    def setUp(self):
        super().setUp()
        self.campus = Authority(self.folder, "campus authority")
        name_machine(self.folder)
        self.addCleanup(subprocess.run, ["umount", "/etc/hosts"], check=True)

    def second_machine(self, **settings):
        """A simulation server on the other machine."""
        return self.enterContext(There(self.outside, port=free_port(following=30), **{
            **LOCAL, "server": self.host, "ssl": True, "portRewrite": True, "gateway": True, "trustedProxies": [own_network.OWN],
            "hostNames": [MACHINE], **settings}))

    def reached_by_tls(self, machine, host=MACHINE):
        return {"address": f"{self.host}/{machine.port}", "internal": f"https://{host}:{machine.port}"}

    def handshakes(self, session):
        text = session.get("/metrics")
        return {kind: int(re.search(rf'upstream_handshakes_total{{result="{kind}"}} (\d+)', text)[1]) for kind in ("full", "resumed", "failed")}

    async def test_nothing_is_to_be_read_on_the_wire(self):
        certificate, key = self.campus.issue("machine", f"DNS:{MACHINE}", f"IP:{own_network.PRIVATE}")
        encrypted = self.second_machine(sslCertificate=certificate, sslKey=key)
        plain = self.second_machine()
        session = self.session(self.reached_by_tls(encrypted), {"address": f"{self.host}/{plain.port}",
                                                               "internal": f"{own_network.PRIVATE}:{plain.port}"}, caFile=self.campus.certificate)
        wait_until(lambda: session.get("/metrics").count('state="up"} 2'), lambda: f"both are found:\n{session.log()}")
        with Wire() as wire:
            for mode in ("w3d", "mjpeg"):
                await self.visit(mode, f"wss://{self.host}/{plain.port}")
        for known in (WORLD_FILE, TOLD, PICTURES, b"GET /client", b"/simulation/"):
            self.assertTrue(known in wire.recorded, f"{known}: the wire is watched")
        with Wire() as wire:
            for mode in ("w3d", "mjpeg"):
                await self.visit(mode, f"wss://{self.host}/{encrypted.port}")
        self.assertGreater(len(wire.recorded), 10_000)
        for known in (WORLD_FILE, TOLD, PICTURES, b"GET /client", b"/simulation/"):
            self.assertFalse(known in wire.recorded, f"{known} is to be read on the wire")
        counts = self.handshakes(session)
        self.assertEqual((counts["full"], counts["failed"]), (1, 0), "one tunnel pays for all")
        self.assertGreater(counts["resumed"], 3)

    async def test_a_certificate_that_is_renewed_disturbs_nobody(self):
        shown = [os.path.join(self.folder, name) for name in ("live.pem", "live_key.pem")]

        def show(pair):
            for source, target in zip(pair, shown):
                shutil.copy(source, target + ".new")
                os.replace(target + ".new", target)
        show(self.campus.issue("first", f"IP:{own_network.PRIVATE}"))
        machine = self.second_machine(sslCertificate=shown[0], sslKey=shown[1])
        session = self.session(self.reached_by_tls(machine, own_network.PRIVATE), caFile=self.campus.certificate)
        answers, is_over = [], threading.Event()

        def ask():
            while not is_over.is_set():
                answers.append(self.fetch(f"/{machine.port}/load")[0])
        asking = [threading.Thread(target=ask) for _ in range(2)]
        for thread in asking:
            thread.start()
        try:
            show(self.campus.issue("second", f"IP:{own_network.PRIVATE}"))
            await asyncio.to_thread(wait_until, lambda: "was read again" in machine.log(), "the machine takes the renewed certificate")
            more = len(answers) + 20
            await asyncio.to_thread(wait_until, lambda: len(answers) > more, "requests go on")
            await self.visit("mjpeg", f"wss://{self.host}/{machine.port}")
        finally:
            is_over.set()
            for thread in asking:
                thread.join()
        self.assertEqual(set(answers), {200})
        counts = self.handshakes(session)
        self.assertEqual(counts["failed"], 0)
        self.assertLess(counts["full"], 6, "one for each certificate, or one more where two are asked for at once")
        self.assertGreater(counts["resumed"], 20)


class Peer(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Length", "3")
        self.end_headers()
        self.wfile.write(b"1.0")

    def log_message(self, *_):
        pass


class Machine(Served):
    """Answers /load, by TLS or without; `names` as its certificate has them."""

    def __init__(self, pair=None):
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Peer)
        self.server.daemon_threads = True
        self.port = self.server.server_address[1]
        if pair:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(*pair)
            self.server.socket = context.wrap_socket(self.server.socket, server_side=True, do_handshake_on_connect=False)
        self.server.handle_error = lambda *_: None


class WhomItTrusts(Site):
    def setUp(self):
        super().setUp()
        self.campus = Authority(self.folder, "campus authority")
        self.stranger = Authority(self.folder, "another authority")

    def entry_of(self, machine, host="localhost"):
        return {"address": f"{self.host}/{machine.port}", "internal": f"https://{host}:{machine.port}"}

    def problem(self, session, machine):
        """What /monitor says of it; nothing before it shows a new list."""
        page = json.loads(session.get("/monitor", {"Accept": "application/json"}))
        rows = [row for row in page["servers"] if row["address"].endswith(f"/{machine.port}")]
        return rows[0].get("problem", "") if rows else ""

    def test_what_is_wrong_with_a_certificate_is_said_and_harms_no_other_machine(self):
        good, numeric = (self.enterContext(Machine(self.campus.issue("good", "DNS:localhost", "IP:127.0.0.1"))) for _ in range(2))
        expired = self.enterContext(Machine(self.campus.issue("expired", "DNS:localhost", days=-1)))
        other = self.enterContext(Machine(self.campus.issue("other", "DNS:other.example.org", "IP:10.1.2.3")))
        unknown = self.enterContext(Machine(self.stranger.issue("unknown", "DNS:localhost")))
        signed_itself = self.enterContext(Machine(self_signed(self.folder, "DNS:localhost")))
        plain = self.enterContext(Machine())
        silent = self.enterContext(socket.create_server(("127.0.0.1", 0)))
        silent_port = silent.getsockname()[1]
        session = self.session(self.entry_of(good), self.entry_of(numeric, "127.0.0.1"), *map(self.entry_of, (expired, other, unknown, signed_itself, plain)),
                               {"address": f"{self.host}/{silent_port}", "internal": f"https://127.0.0.1:{silent_port}"},
                               caFile=self.campus.certificate)
        late = []
        slow = threading.Thread(target=lambda: late.append(self.fetch(f"/{silent_port}/load")[0]))
        slow.start()
        for machine, sentence in ((expired, r"its certificate expired on .* GMT: renew it there"),
                                  (other, r"its certificate is for other\.example\.org, 10\.1\.2\.3, not for localhost"),
                                  (unknown, r"put the authority's certificate into \"caFile\""),
                                  (signed_itself, r"no authority that this server trusts has signed its certificate: .*\"caFile\""),
                                  (plain, r"it was asked by https, and speaks no TLS")):
            wait_until(lambda: re.search(sentence, self.problem(session, machine)), lambda: f"{sentence}\n{self.problem(session, machine)}")
            self.assertEqual(self.fetch(f"/{machine.port}/load")[0], 502)
            wait_until(lambda: re.search(rf"Can't pass a request on to https://localhost:{machine.port}: .*{sentence}", session.log()), session.log)
        for machine in (good, numeric):
            self.assertEqual(self.fetch(f"/{machine.port}/load"), (200, "1.0"), "while another one does not shake hands")
        silent.close()
        slow.join()
        self.assertIn(late[0], (502, 504))
        self.assertEqual((self.problem(session, good), self.problem(session, numeric)), ("", ""))

    def test_a_certificate_may_vouch_for_itself_and_the_file_may_change(self):
        pair = self_signed(self.folder, "DNS:localhost")
        machine = self.enterContext(Machine(pair))
        file = os.path.join(self.folder, "trusted.pem")
        shutil.copy(self.stranger.certificate, file)
        session = self.session(caFile=file)
        session.reread(simulationServers=[self.entry_of(machine)])
        wait_until(lambda: "caFile" in self.problem(session, machine), "it is not trusted")
        with open(pair[0]) as trusted, open(file + ".new", "w") as target:
            target.write(trusted.read())
        os.replace(file + ".new", file)
        wait_until(lambda: session.get("/") == "1", session.log)
        self.assertEqual(self.fetch(f"/{machine.port}/load")[0], 200)
        wait_until(lambda: "were read again" in session.log(), session.log)
        with open(file, "w") as nothing:
            nothing.write("no certificate")
        self.assertEqual(self.fetch(f"/{machine.port}/load")[0], 200)
        wait_until(lambda: "The certificates that this server trusts stay as they were" in session.log(), session.log)

    async def test_the_configurations_of_two_machines_make_a_site(self):
        """With two certificates that have signed themselves, as ./server.sh makes them."""
        config = {}
        for kind in ("session", "simulation"):
            with open(os.path.join(CONFIG, kind, "two_machines.json")) as file:
                config[kind] = json.load(file)
        certificate, key = self_signed(self.folder, "DNS:localhost")
        machine = self.machine(**{**config["simulation"], **LOCAL, "server": self.host, "port": free_port(following=30), "listenAddress": "::",
                                  "sslCertificate": certificate, "sslKey": key})
        entry = json.loads(json.dumps(config["session"]["simulationServers"]).replace("2000", str(machine.port)).replace(
            '"localhost/', f'"{self.host}/'))
        await asyncio.to_thread(self.session, *entry, caFile=certificate, viewerUrl=config["session"]["viewerUrl"])
        await self.visit("mjpeg", f"wss://{self.host}/{machine.port}")

    def test_a_file_without_certificates_is_refused_at_the_start(self):
        session = self.session()
        for content, sentence in (("nothing", "caFile.*can't be used: expected a PEM file"), (None, "caFile.*can't be used: No such file")):
            file = os.path.join(self.folder, "empty.pem")
            if content:
                with open(file, "w") as text:
                    text.write(content)
            else:
                os.remove(file)
            session.configure(caFile=file)
            status, said = session.command("--check-config")
            self.assertNotEqual(status, 0)
            self.assertRegex(said, sentence)


if __name__ == "__main__":
    own_network.enter()
    main()
