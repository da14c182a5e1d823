#!/usr/bin/python3
"""Who counts as the operator, and which web pages may use a server: attacks with a real browser and real proxies."""

import asyncio
import contextlib
import hashlib
import http.client
import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support import haproxy, nginx  # noqa: E402
from support.browser import open_browser  # noqa: E402
from support.browser_client import Browser, server, websockets  # noqa: E402
from support.forwarded_socket import forwarded  # noqa: E402
from support.machine import Machine  # noqa: E402
from support.other_user import NOBODY, OwnedServer  # noqa: E402
from support.raw_websocket import read_all  # noqa: E402
from support.servers import SessionServer, free_port, main, program, wait_until  # noqa: E402
from support.web_site import web_site  # noqa: E402

EVIL = "evil.example"  # Chromium is told that this name is this machine's, as a name server that rebinds would

EVIL_PAGE = """<!DOCTYPE html><title>loading</title>
<form id="form" method="post" target="frame" action="http://localhost:{port}/api/drain?exit"></form><iframe name="frame"></iframe>
<script>
const open = url => new Promise(resolve => {{
  const socket = new WebSocket(url);
  socket.onopen = () => {{ socket.close(); resolve('open'); }};
  socket.onerror = () => resolve('refused');
}});
const read = url => fetch(url).then(answer => answer.status, () => 'unreadable');
(async () => {{
  const told = {{}};
  await fetch('http://localhost:{port}/api/drain?exit', {{method: 'POST', mode: 'no-cors'}});
  const framed = new Promise(resolve => document.querySelector('iframe').addEventListener('load', resolve));
  document.getElementById('form').submit();
  await framed;
  for (const path of ['client', 'monitor'])
    told[path] = await open('ws://localhost:{port}/' + path);
  told.rebound = await open('ws://{evil}:{port}/client');
  told.load = await read('http://localhost:{port}/load');
  window.told = told;
  document.title = 'done';
}})();
</script>"""


def post(port, path, headers):
    """The status of a POST with exactly these headers."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30)
    connection.putrequest("POST", path, skip_host="Host" in headers)
    for name, value in {"Content-Length": "0", **headers}.items():
        connection.putheader(name, value)
    connection.endheaders()
    with contextlib.closing(connection):
        return connection.getresponse().status


class Pages(unittest.TestCase):
    """Pages of other sites in a browser on the operator's own machine."""

    def test_a_page_of_another_site_neither_drains_nor_uses_a_server_of_this_machine(self):
        with server() as simulation, web_site(EVIL_PAGE.format(port=simulation.port, evil=EVIL)) as site:
            with open_browser(800, 600, hosts=[EVIL]) as browser:
                browser.get(f"http://{EVIL}:{site}/")
                wait_until(lambda: browser.title == "done", "the page has tried everything")
                self.assertEqual(browser.execute_script("return window.told"),
                                 {"client": "refused", "monitor": "refused", "rebound": "refused", "load": "unreadable"})
                browser.get(f"http://{EVIL}:{simulation.port}/monitor")  # now it would be of our own origin
                self.assertIn("This server has another name", browser.page_source)
                self.assertEqual(browser.execute_script("return fetch('/api/drain', {method: 'POST'}).then(answer => answer.status)"), 421)
            self.assertEqual(simulation.ask("/readyz"), (200, "ready"))
            self.assertIn(f"Refused a WebSocket of a page of http://{EVIL}:{site}: to let it in, add \"http://{EVIL}:{site}\" to \"allowedOrigins\"",
                          simulation.log())
            self.assertIn(f"Refused a request to the name \"{EVIL}:{simulation.port}\"", simulation.log())

    def test_no_foreign_page_shows_ours_in_its_frame(self):
        with SessionServer([]) as session:
            page = f'<!DOCTYPE html><title>t</title><iframe src="http://localhost:{session.port}/viewer/"></iframe>'
            with web_site(page) as site, open_browser(800, 600, hosts=[EVIL]) as browser:
                def framed():
                    browser.switch_to.default_content()
                    browser.switch_to.frame(0)
                    return "Simulation viewer" in browser.page_source

                browser.get(f"http://{EVIL}:{site}/")
                self.assertFalse(framed())
                session.reread(frameAncestors=[f"http://{EVIL}:{site}"])
                wait_until(lambda: "The configuration was read again" in session.log(), "read again")
                browser.get(f"http://{EVIL}:{site}/")
                self.assertTrue(framed())


class Origins(unittest.IsolatedAsyncioTestCase):
    async def opens(self, server, path, **origin):
        try:
            async with websockets.connect(f"ws://localhost:{server.port}{path}", **origin):
                return True
        except websockets.InvalidStatusCode as refusal:
            self.assertEqual(refusal.status_code, 403)
            return False

    async def test_the_origins_of_a_private_and_of_a_public_server(self):
        with Machine() as machine, SessionServer([machine.address]) as session, server() as simulation:
            for one, path in ((session, "/"), (session, "/monitor"), (session, "/session"), (simulation, "/client"),
                              (simulation, "/monitor")):
                self.assertTrue(await self.opens(one, path), "a program")
                for origin in ("http://localhost:1999", "https://webots.cloud"):
                    self.assertTrue(await self.opens(one, path, origin=origin), origin)
                for origin in ("null", "https://anybody.example"):
                    self.assertFalse(await self.opens(one, path, origin=origin), f"{origin} at {path}")
            simulation.reread(allowedOrigins=["null", "https://*.school.example"])
            wait_until(lambda: "The configuration was read again" in simulation.log(), "read again")
            for origin in ("null", "https://a.school.example", "http://localhost:1999"):
                self.assertTrue(await self.opens(simulation, "/client", origin=origin), origin)
            self.assertFalse(await self.opens(simulation, "/client", origin="https://webots.cloud"))
        with server(server="sim.example.org") as public:
            for origin in ("null", "https://anybody.example"):
                self.assertTrue(await self.opens(public, "/client", origin=origin), "as ever")


class Operators(unittest.IsolatedAsyncioTestCase):
    def test_nobody_is_the_operator_for_coming_from_this_machine(self):
        with server() as simulation:
            for headers in ({}, {"X-Forwarded-For": ""}, {"Forwarded": ""}, {"Authorization": "Bearer "}):
                self.assertEqual(post(simulation.port, "/api/drain?exit", headers), 404, headers)
            port = free_port()
            with haproxy.proxies({port: simulation.port}):
                self.assertEqual(post(port, "/api/drain?exit", {"X-Forwarded-For": ""}), 404)
            with nginx.reverse_proxy(simulation.port) as origin:
                self.assertEqual(post(int(origin.rsplit(":", 1)[1]), "/api/drain?exit", {"Host": "localhost"}), 404)
            self.assertEqual(simulation.ask("/readyz"), (200, "ready"))

    @unittest.skipUnless(os.geteuid() == 0, "only root can run a server as another user")
    def test_root_may_hand_a_secret_to_the_group_of_the_server(self):
        with tempfile.TemporaryDirectory() as folder:
            os.chmod(folder, 0o755)
            path = os.path.join(folder, "token")
            with open(path, "w") as file:
                file.write("0123456789abcdef0123")
            os.chown(path, 0, NOBODY)
            os.chmod(path, 0o640)
            with OwnedServer(user=NOBODY, operatorTokenFile=path) as simulation:
                for owner, mode, is_refused in ((0, 0o440, False), (0, 0o660, True), (0, 0o644, True), (NOBODY, 0o640, True)):
                    os.chown(path, owner, NOBODY)
                    os.chmod(path, mode)
                    checked = subprocess.run([simulation.program(), "--check-config", simulation.configure()], user=NOBODY, group=NOBODY,
                                             extra_groups=[], capture_output=True, text=True, timeout=60, cwd=folder)
                    self.assertEqual("others may read it too" in checked.stderr, is_refused, (owner, oct(mode), checked.stderr))

    def test_the_token_of_the_operator_counts_over_the_network(self):
        token = "0123456789abcdef0123"
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "token")
            with open(path, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
                file.write("sha256:" + hashlib.sha256(token.encode()).hexdigest() + "\n")
            with server(operatorTokenFile=path) as simulation:
                def drain(token, host="localhost"):
                    return post(simulation.port, "/api/drain", {"Host": host, "Authorization": f"Bearer {token}"})

                with open(path) as file:
                    self.assertEqual(drain(file.read().strip()), 404, "what the file says is not the token")
                self.assertEqual(drain(token[:-1]), 404)
                self.assertEqual(drain(token, EVIL), 421)
                self.assertEqual(simulation.ask("/readyz"), (200, "ready"))
                self.assertEqual(drain(token), 200)
                self.assertEqual(simulation.ask("/readyz"), (503, "draining"))
                os.chmod(path, 0o640)
                simulation.reread()
                wait_until(lambda: "others may read it too" in simulation.log(), "a token that others may read is refused")
                self.assertEqual(drain(token), 200, "the configuration stays as it was")
            started = subprocess.run([program(simulation.PROGRAM), simulation_config(folder, operatorTokenFile=path)],
                                     capture_output=True, text=True, timeout=60, cwd=folder, env={**os.environ, "TMPDIR": folder})
            self.assertEqual(started.returncode, 2)
            self.assertIn(f"the operator's token in {path}: others may read it too", started.stderr)

    def test_operator_requests_of_pages_of_other_sites_are_refused_even_over_a_forwarded_socket(self):
        with server() as simulation, forwarded(simulation.operator_socket()) as port:
            for headers in ({"Origin": f"http://{EVIL}"}, {"Origin": "null"}, {"Origin": f"http://localhost:{simulation.port + 1}"},
                            {"Host": f"{EVIL}:{port}", "Origin": f"http://{EVIL}:{port}"}):
                self.assertEqual(post(port, "/api/drain", {"Host": f"localhost:{port}", **headers}), 403, headers)
            self.assertEqual(simulation.ask("/readyz"), (200, "ready"))
            self.assertEqual(post(port, "/api/drain", {"Host": f"localhost:{port}", "Origin": f"http://localhost:{port}"}), 200)
            self.assertEqual(simulation.ask("/readyz"), (503, "draining"))

    async def test_the_operator_ends_a_simulation_and_drains_a_machine_by_command(self):
        with server() as simulation, SessionServer([simulation.address]) as session:
            async with Browser(simulation) as browser:
                await browser.start()
                await browser.hear("webots:")
                self.assertEqual(simulation.command("--end", "7")[0], 1)
                self.assertEqual(simulation.command("--end", "x&y"), (1, "webots-simulation-server: Expected the number of a simulation, as in /api/end?simulation=3."))
                self.assertEqual(simulation.command("--end", "1"), (0, "ending"))
                self.assertEqual(await browser.hear_all(), 1005)
                self.assertEqual(browser.told[-1], "loading: Error: The operator has ended this simulation.")
            simulation.wait_until_clean()
            wait_until(lambda: session.get("/session") == f"ws://{simulation.address}", "no machine")
            self.assertEqual(session.command("--drain", simulation.address), (0, "draining"))
            self.assertEqual(session.get("/session"), "Error: no simulation server available at the moment.")
            self.assertEqual(simulation.ask("/readyz"), (200, "ready"), "the machine itself knows nothing of it")
            status, told = session.command("--drain", "sim7&off")
            self.assertEqual(status, 1)
            self.assertIn("There is no machine sim7&amp;off in", told)
            self.assertEqual(session.ask(f"/api/drain?machine={simulation.address}&off", "POST")[0], 404)
            self.assertEqual(session.command("--resume", simulation.address), (0, "serving"))
            self.assertEqual(session.get("/session"), f"ws://{simulation.address}")

    def test_another_user_of_the_machine_is_no_operator(self):
        if os.geteuid() != 0 or not shutil.which("setpriv"):
            self.skipTest("needs root, to become somebody else")
        with server() as simulation:
            path = simulation.operator_socket()
            os.chmod(os.path.dirname(path), 0o755)
            for folder in (simulation.folder, os.path.join(simulation.folder, "tmp")):
                os.chmod(folder, 0o755)
            os.chmod(path, 0o666)  # even then
            script = ("import socket, sys; s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); "
                      "s.sendall(b'POST /api/drain HTTP/1.1\\r\\nHost: x\\r\\n\\r\\n'); print(len(s.recv(100)))")
            subprocess.run(["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", "/usr/bin/python3", "-c", script, path],
                           capture_output=True, timeout=30)
            wait_until(lambda: "Refused a connection to the operator's socket: user 65534 is not ours" in simulation.log(), "refused")
            self.assertEqual(simulation.ask("/readyz"), (200, "ready"))
            self.assertEqual(simulation.command("--drain"), (0, "draining"))

    async def test_a_simulation_does_not_drain_its_own_server(self):
        """Its programs run as the server's user, and find the socket."""
        with tempfile.TemporaryDirectory() as home:
            webots, told = os.path.join(home, "webots"), os.path.join(home, "told")
            simulation = server(webotsHome=home)
            with open(webots, "w") as file:
                file.write(f"""#!/usr/bin/python3
import os, socket, sys
s = socket.socket(socket.AF_UNIX)
try:
    s.connect({simulation.operator_socket()!r})
    s.sendall(b'POST /api/drain HTTP/1.1\\r\\nHost: x\\r\\n\\r\\n')
    answer = s.recv(100).decode()
except OSError as error:
    answer = str(error)
with open({told + ".part"!r}, 'w') as file:
    file.write(answer)
os.rename({told + ".part"!r}, {told!r})
os.execv({program('webots-demo-simulator')!r}, ['webots', *sys.argv[1:]])
""")
            os.chmod(webots, 0o755)
            with simulation:
                async with Browser(simulation) as browser:
                    await browser.start()
                    await browser.hear("webots:")
                with open(told) as file:
                    self.assertNotIn("HTTP/1.1", file.read())
                self.assertIn("belongs to a simulation, or has ended", simulation.log())
                self.assertEqual(simulation.ask("/readyz"), (200, "ready"))

    def test_a_socket_that_a_dead_server_left_is_in_nobodys_way(self):
        with server() as simulation:
            simulation.process.kill()
            simulation.process.wait()
            self.assertEqual(simulation.command("--drain")[0], 1)
            simulation.start()
            self.assertEqual(simulation.command("--drain"), (0, "draining"))
            simulation.stop()
            self.assertFalse(os.path.exists(simulation.operator_socket()))
            status, told = simulation.command("--drain")
            self.assertEqual(status, 1)
            self.assertIn("Does a server with this configuration run on this machine, as this user?", told)

    def test_the_socket_answers_everything_without_the_monitors_password(self):
        with SessionServer([], monitorPassword="open sesame") as session, socket.socket(socket.AF_UNIX) as client:
            client.connect(session.operator_socket())
            client.sendall(b"GET /monitor HTTP/1.1\r\nHost: localhost\r\n\r\n")
            self.assertTrue(read_all(client).endswith(b"</html>\n"))

    def test_whoever_connects_and_says_nothing_is_waited_for_briefly(self):
        with SessionServer([]) as session, socket.socket(socket.AF_UNIX) as silent:
            silent.connect(session.operator_socket())
            self.assertEqual(session.command("--decisions"), (0, "Nobody has asked for a simulation yet."))
            self.assertEqual(session.command("--decisions", "--json"), (0, json.dumps({"decisions": []}, separators=(",", ":"))))

    def test_the_monitor_asks_for_its_password(self):
        with SessionServer([], monitorPassword="open sesame") as session:
            for path in ("/monitor", "/metrics"):
                self.assertEqual(session.ask(path)[0], 401)
                self.assertEqual(session.ask(path, headers={"Authorization": "Basic b3BlcmF0b3I6b3BlbiBzZXNhbWU="})[0], 200)
            self.assertEqual(session.ask("/livez"), (200, "alive"))


def simulation_config(folder, **keys):
    path = os.path.join(folder, "c.json")
    with open(path, "w") as file:
        json.dump({"port": 24999, "notify": [], "server": "localhost", **keys}, file)
    return path


if __name__ == "__main__":
    main()
