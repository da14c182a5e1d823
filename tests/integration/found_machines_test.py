#!/usr/bin/python3
"""A cloud site whose machines come and go behind the session server's one port: found by name, by a real name server (dnsmasq), or
announced. docs/discovery.md, protocol section 13.13.

The browser, the session server and each machine have networks of their own. The browser reaches the session server alone, which passes
nothing on but what its gateway does.
"""

import asyncio
import json
import os
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from support import own_network  # noqa: E402
from support.browser_client import LOCAL, websockets  # noqa: E402
from support.certificates import Authority  # noqa: E402
from support.frames import PICTURE  # noqa: E402
from support.name_server import NameServer  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, wait_until  # noqa: E402
from support.visitor import Visitor  # noqa: E402

GATE = "10.78.0.2"  # the session server, for the browser
PORT = 2000  # of every machine: so `/2000/` would not tell them apart

FETCH = """
import sys, urllib.request
print(urllib.request.urlopen(sys.argv[1], timeout=5).read().decode(), end="")
"""


class Behind(SimulationServer):
    """A machine that only the session server reaches. Of itself it knows its port."""

    def __init__(self, where, address, **settings):
        super().__init__(port=PORT, **{**LOCAL, "gateway": True, "trustedProxies": [address.rpartition(".")[0] + ".1"], **settings})
        self.wrapper = where.wrapper
        self.address = f"{address}:{PORT}"

    def get(self, path, headers=None):
        """As it answers there."""
        finished = subprocess.run([*self.wrapper, sys.executable, "-c", FETCH, f"http://127.0.0.1:{PORT}{path}"], capture_output=True,
                                  text=True, timeout=PATIENCE)
        return finished.stdout if finished.returncode == 0 else None


class BehindTls(Behind):
    def get(self, path, headers=None):
        return self.process.poll() is None and "server on port" in self.log() or None


class Site(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_found_"))
        self.gate = self.enterContext(own_network.Elsewhere())
        own_network.cable(None, self.gate, "10.78.0")
        self.addCleanup(subprocess.run, ["ip", "link", "del", "a10_78_0"], check=False)
        self.names = self.enterContext(NameServer(host=GATE, wrapper=self.gate.wrapper))
        self.machines = 0

    def secret(self):
        file = os.path.join(self.folder, "secret")
        if not os.path.exists(file):
            with open(file, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as written:
                written.write(secrets.token_hex(32) + "\n")
        return file

    def machine(self, kind=Behind, **settings):
        """One more machine; the caller enters it."""
        self.machines += 1
        where = self.enterContext(own_network.Elsewhere())
        network = f"10.79.{self.machines}"
        own_network.cable(self.gate, where, network)
        return kind(where, f"{network}.2", **settings)

    def session(self, *entries, **settings):
        port = free_port()
        server = SessionServer(list(entries), port=port, nameServers=[self.names.address], server=GATE, **settings)
        server.wrapper = self.gate.wrapper
        server.url = f"http://{GATE}:{port}"
        self.enterContext(server)
        return server

    def found(self, session):
        """What the monitor page says: address -> (its path, its load or its problem)."""
        shown = json.loads(session.get("/monitor", {"Accept": "application/json"}))
        return {each["address"]: (each.get("path"), each["load"] if each["load"] is not None else each.get("problem"))
                for each in shown["servers"]}

    def wait_for(self, session, *machines):
        wait_until(lambda: {address for address, (_, load) in self.found(session).items() if isinstance(load, (int, float))}
                   == {machine.address for machine in machines}, lambda: f"the machines are found: {self.found(session)}\n{session.log()}")

    def status(self, session, path, **headers):
        return session.ask(path, headers=headers)[0]

    async def look(self, session, address, path, mode="mjpeg"):
        """What a browser does with the address of its simulation, which is below that path."""
        base = f"{session.url.replace('http', 'ws', 1)}{path}"
        self.assertRegex(address, rf"^webots:{base}/simulation/[a-z]{{28}}/\d+$")
        address = address.removeprefix("webots:")
        viewer = await websockets.connect(f"{address}/", open_timeout=PATIENCE)
        await viewer.send("mjpeg: 320x240" if mode == "mjpeg" else mode)
        while "scene load completed" not in await asyncio.wait_for(viewer.recv(), PATIENCE):
            pass
        await viewer.send("real-time:-1")
        files = address.replace("ws", "http", 1)

        def read():
            if mode == "w3d":
                with urllib.request.urlopen(f"{files}/worlds/arena.wbt", timeout=PATIENCE) as world:
                    return self.assertTrue(world.read().startswith(b"#VRML_SIM"))
            with urllib.request.urlopen(f"{files}/mjpeg", timeout=PATIENCE) as stream:
                received = b""
                while received.count(PICTURE) < 2:
                    received += stream.read1(1 << 16)
        await asyncio.to_thread(read)
        return viewer

    async def visit(self, session, **members):
        browser = await self.enterAsyncContext(Visitor(session))
        await browser.start(**members)
        return browser, await browser.hear("webots:")

    @staticmethod
    def path_in(address):
        """`/machine/<id>` of a simulation's address."""
        return "/machine/" + address.partition("/machine/")[2].partition("/")[0]


class ByName(Site):
    async def both_ways(self, relay, **settings):
        """Simulations on two machines that have one name."""
        first, second = self.enterContext(self.machine(**settings)), self.enterContext(self.machine(**settings))
        self.names.tell(sim=["10.79.1.2", "10.79.2.2"])
        session = self.session({"address": f"dns:sim.test:{PORT}", "internal": "http"}, relay=relay, **settings)
        self.wait_for(session, first, second)
        shown = self.found(session)
        paths = {shown[machine.address][0] for machine in (first, second)}
        self.assertEqual(len(paths), 2)
        used = set()
        while used != {(path, mode) for path in paths for mode in ("mjpeg", "w3d")}:
            mode = ("mjpeg", "w3d")[len(used) // 2]
            browser, address = await self.visit(session, mode=mode)
            viewer = await self.look(session, address, self.path_in(address), mode)
            used.add((self.path_in(address), mode))
            self.assertEqual(browser.errors(), [])
            await viewer.close()
        for machine in (first, second):
            path = shown[machine.address][0]
            self.assertEqual(self.status(session, f"{path}/load"), 200)
            self.assertIn("<h1>", session.get(f"{path}/monitor"))
            for wrong in ("metrics", "api/drain", "/metrics", "%6Detrics", "livez/../metrics"):
                self.assertEqual(self.status(session, f"{path}/{wrong}"), 404, wrong)
        for wrong in (f"/{PORT}/load", "/machine/10.79.1.2:2000/load", "/machine/" + 24 * "a" + "/load", "/machine/load",
                      f"{path}x/load", f"{path[:-1]}/load"):
            self.assertEqual(self.status(session, wrong), 404, wrong)
        return session

    async def test_a_simulation_runs_through_the_one_port(self):
        session = await self.both_ways(relay=False)
        self.assertRegex(session.get("/session"), rf"^{session.url.replace('http', 'ws')}/machine/[a-p]{{24}}$")

    async def test_and_with_a_session_server_that_relays(self):
        session = await self.both_ways(relay=True)
        self.assertEqual(session.get("/session"), session.url.replace("http", "ws"))

    async def test_and_with_tickets(self):
        session = await self.both_ways(relay=False, sessionSecret=self.secret())
        place = session.get("/session")
        self.assertIn("/ticket/", place)
        stranger = await self.enterAsyncContext(Visitor(session))
        await stranger.open(place.partition("/ticket/")[0])
        await stranger.say(start={"url": "local:/demo_projects/robots/blob/main/worlds/arena.wbt", "mode": "mjpeg"})
        self.assertIn("start through its session server", await stranger.hear("loading: Error:"))

    async def test_the_browser_reaches_nothing_else(self):
        self.enterContext(self.machine())
        with self.assertRaises(OSError):
            urllib.request.urlopen(f"http://10.79.1.2:{PORT}/load", timeout=1)

    async def test_a_machine_that_leaves_keeps_its_tunnels_and_returns_to_its_path(self):
        staying, leaving = self.enterContext(self.machine()), self.enterContext(self.machine())
        self.names.tell(sim=["10.79.2.2"])
        session = self.session({"address": f"dns:sim.test:{PORT}", "internal": "http"}, relay=True)
        self.wait_for(session, leaving)
        browser, address = await self.visit(session)
        path = self.path_in(address)
        viewer = await self.look(session, address, path)
        self.names.tell(sim=["10.79.1.2"])
        await asyncio.to_thread(self.wait_for, session, staying)
        self.assertEqual(self.status(session, f"{path}/load"), 404, "its path is gone")
        pong = await viewer.ping()
        await asyncio.wait_for(pong, PATIENCE)  # the demo simulator answers, through the tunnel
        self.assertIsNone(browser.close_code)
        self.names.tell(sim=["10.79.1.2", "10.79.2.2"])
        await asyncio.to_thread(self.wait_for, session, staying, leaving)
        self.assertEqual(self.found(session)[leaving.address][0], path)
        self.assertEqual(self.status(session, f"{path}/load"), 200)
        await viewer.close()

    async def test_other_services_that_a_name_server_points_at_are_not_reached(self):
        """Whoever can forge its answers would have the gateway talk to anything inside."""
        where = self.enterContext(own_network.Elsewhere())
        own_network.cable(self.gate, where, "10.80.0")
        service = subprocess.Popen([*where.wrapper, sys.executable, "-c", SERVICE, str(PORT)], stdout=subprocess.PIPE, text=True)
        self.addCleanup(service.stdout.close)
        self.addCleanup(service.wait)
        self.addCleanup(service.kill)
        self.assertEqual(service.stdout.readline(), "listens\n")
        self.names.tell(sim=["10.80.0.2", "127.0.0.1", "169.254.169.254"])
        session = self.session({"address": f"dns:sim.test:{PORT}", "internal": "http"}, relay=True)
        wait_until(lambda: self.found(session).get(f"10.80.0.2:{PORT}", ("", ""))[1] == "it is not a simulation server of webots_cloud",
                   lambda: f"it is found out: {self.found(session)}")
        self.assertEqual(set(self.found(session)), {f"10.80.0.2:{PORT}"})
        path = self.found(session)[f"10.80.0.2:{PORT}"][0]
        for target in ("/secret", "/load", "/", "/client"):
            self.assertEqual(self.status(session, path + target), 502, target)
        self.assertEqual(session.get("/session"), session.url.replace("http", "ws"), "people may wait")
        service.kill()
        asked = service.stdout.read().split()
        self.assertEqual(set(asked), {"/load"}, "polls are all that it was asked")

    async def test_a_machine_that_does_not_trust_the_gateway_says_so(self):
        machine = self.enterContext(self.machine(trustedProxies=[]))
        self.names.tell(sim=["10.79.1.2"])
        session = self.session({"address": f"dns:sim.test:{PORT}", "internal": "http"})
        self.wait_for(session, machine)
        browser = await self.enterAsyncContext(Visitor(session))
        await browser.start()
        self.assertIn("not set up for the gateway of its session server", await browser.hear("loading: Error:"))
        self.assertIn('10.79.1.1 would not reach its simulation: add it to "trustedProxies"', machine.log())

    async def test_by_tls_with_one_certificate_for_the_name_that_all_have(self):
        authority = Authority(self.folder, "campus")
        certificate, key = authority.issue("machines", "DNS:sim.test")
        machine = self.enterContext(self.machine(BehindTls, sslCertificate=certificate, sslKey=key, hostNames=["sim.test"]))
        wrong_certificate, wrong_key = authority.issue("others", "DNS:other.test")
        self.enterContext(self.machine(BehindTls, sslCertificate=wrong_certificate, sslKey=wrong_key))
        self.names.tell(sim=["10.79.1.2", "10.79.2.2"])
        session = self.session({"address": f"dns:sim.test:{PORT}", "internal": "https"}, relay=True, caFile=authority.certificate)
        self.wait_for(session, machine)
        browser, address = await self.visit(session)
        viewer = await self.look(session, address, self.path_in(address))
        await viewer.close()
        wait_until(lambda: "not for sim.test" in str(self.found(session)[f"10.79.2.2:{PORT}"][1]), lambda: f"the other one: {self.found(session)}")

    async def test_a_machine_that_is_too_busy_for_tls_is_still_passed_on_to(self):
        authority = Authority(self.folder, "campus")
        certificate, key = authority.issue("machines", "DNS:sim.test")
        machine = self.enterContext(self.machine(BehindTls, sslCertificate=certificate, sslKey=key, hostNames=["sim.test"]))
        self.names.tell(sim=["10.79.1.2"])
        session = self.session({"address": f"dns:sim.test:{PORT}", "internal": "https"}, caFile=authority.certificate, loadRefresh=1, loadTimeout=1)
        self.wait_for(session, machine)
        path = self.found(session)[machine.address][0]
        machine.process.send_signal(signal.SIGSTOP)
        try:
            wait_until(lambda: "TLS failed: no answer in time" in str(self.found(session)), lambda: f"it is late: {self.found(session)}")
            self.assertEqual(self.status(session, f"{path}/load"), 504, "it is asked, and has five seconds")
        finally:
            machine.process.send_signal(signal.SIGCONT)
        self.assertEqual(self.status(session, f"{path}/load"), 200)


SERVICE = """
import http.server, sys
class Handler(http.server.BaseHTTPRequestHandler):
    def do_GET(self):
        print(self.path, flush=True)
        body = b"7.5" if self.path == "/load" else b"a secret"
        self.send_response(200); self.send_header("Content-Length", str(len(body))); self.end_headers(); self.wfile.write(body)
    def log_message(self, *_): pass
server = http.server.ThreadingHTTPServer(("0.0.0.0", int(sys.argv[1])), Handler)
print("listens", flush=True)
server.serve_forever()
"""


class Announced(Site):
    async def test_a_simulation_runs_through_the_one_port(self):
        session = self.session({"address": "announced", "internal": "http"}, announcements=True, sessionSecret=self.secret(), relay=True)
        machine = self.machine(server="10.79.1.2", sessionServers=[f"http://10.79.1.1:{session.port}"], sessionSecret=self.secret())
        with machine:
            self.wait_for(session, machine)
            browser, address = await self.visit(session)
            viewer = await self.look(session, address, self.path_in(address))
            await viewer.close()
        wait_until(lambda: self.found(session) == {}, "it says goodbye", 15)
        self.assertEqual(self.status(session, f"{self.path_in(address)}/load"), 404)

    async def test_who_returns_to_a_session_server_that_has_just_started_finds_the_simulation(self):
        """It knows no machine before one announces itself again."""
        session = self.session({"address": "announced", "internal": "http"}, announcements=True, sessionSecret=self.secret(), relay=True)
        machine = self.enterContext(self.machine(server="10.79.1.2", sessionServers=[f"http://10.79.1.1:{session.port}"],
                                                 sessionSecret=self.secret()))
        self.wait_for(session, machine)
        browser, address = await self.visit(session, reconnect=True)
        token = (await browser.hear("reconnectToken: ")).removeprefix("reconnectToken: ")
        await asyncio.to_thread(session.stop)
        await browser.hear_end()
        await asyncio.to_thread(session.start)
        told = len(browser.told)
        await browser.come_back(reconnect=token)
        await browser.until(lambda: browser.find("webots:", told) or browser.close_code is not None, "an answer")
        if browser.close_code is not None:
            self.assertEqual((browser.close_code, browser.told[told:]), (1012, []), "it is to come again")
            await asyncio.to_thread(self.wait_for, session, machine)
            await browser.come_back(reconnect=token)
        self.assertEqual(await browser.hear("webots:", since=told), address)


if __name__ == "__main__":
    own_network.enter()
    if not shutil.which("openssl"):
        raise SystemExit(print("skipped: there is no openssl (package openssl)") or 77)
    main()
