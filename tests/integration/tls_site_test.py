#!/usr/bin/python3
"""A server that speaks TLS to the world by itself: its certificate is renewed, plain requests are led to https, and old TLS is refused."""

import asyncio
import contextlib
import http.client
import json
import os
import re
import shutil
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.browser_client import websockets  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, program, wait_until  # noqa: E402

if not shutil.which("openssl"):
    raise SystemExit(print("skipped: there is no openssl (package openssl)") or 77)


class Certbot:
    """The folders of certbot: `live/site` has links to the newest of the numbered files in `archive/site`."""

    def __init__(self, folder):
        self.folder = folder
        self.number = 0
        for part in ("archive", "live"):
            os.makedirs(os.path.join(folder, part, "site"))
        self.certificate, self.key = (os.path.join(folder, "live", "site", f"{name}.pem") for name in ("fullchain", "privkey"))
        self.renew()

    def renew(self):
        self.number += 1
        archive = os.path.join(self.folder, "archive", "site")
        files = [os.path.join(archive, f"{name}{self.number}.pem") for name in ("fullchain", "privkey")]
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                        "-subj", f"/CN=localhost/serialNumber={self.number}", "-addext", "subjectAltName=DNS:localhost",
                        "-out", files[0], "-keyout", files[1]], check=True, capture_output=True)
        for link, file in zip((self.certificate, self.key), files):  # one after the other, as certbot does
            with contextlib.suppress(FileNotFoundError):
                os.remove(link)
            os.symlink(os.path.relpath(file, os.path.dirname(link)), link)


def unverified():
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context


def shown(server):
    """The certificate that new connections get."""
    with socket.create_connection(("localhost", server.port), timeout=PATIENCE) as plain, \
            unverified().wrap_socket(plain, server_hostname="localhost") as connection:
        return connection.getpeercert(True)


class Visitors(threading.Thread):
    """Connect anew for every request, until they are stopped."""

    def __init__(self, server):
        super().__init__()
        self.server = server
        self.context = unverified()
        self.answers = 0
        self.failures = []
        self.stopped = threading.Event()

    def run(self):
        while not self.stopped.is_set():
            try:
                connection = http.client.HTTPSConnection("localhost", self.server.port, timeout=PATIENCE, context=self.context)
                connection.request("GET", "/session")
                status = connection.getresponse().status
                connection.close()
                if status != 200:
                    self.failures.append(status)
                self.answers += 1
            except (OSError, http.client.HTTPException) as error:
                self.failures.append(repr(error))

    def stop(self):
        self.stopped.set()
        self.join()


class Renewal(unittest.IsolatedAsyncioTestCase):
    async def test_a_renewal_by_certbot_costs_no_request_and_no_connection(self):
        folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_certbot_"))
        certbot = Certbot(folder)
        server = self.enterContext(SessionServer([], sslCertificate=certbot.certificate, sslKey=certbot.key, sessionBurst=0))
        async with websockets.connect(f"wss://localhost:{server.port}/", ssl=unverified()) as watcher:
            self.assertEqual(await asyncio.wait_for(watcher.recv(), PATIENCE), "0")
            visitors = [Visitors(server) for _ in range(4)]
            for visitor in visitors:
                visitor.start()
            try:
                for _ in range(2):
                    before = await asyncio.to_thread(shown, server)
                    certbot.renew()
                    await asyncio.to_thread(wait_until, lambda: shown(server) != before, lambda: f"the old one is shown:\n{server.log()}")
                    answers = [visitor.answers for visitor in visitors]
                    await asyncio.to_thread(wait_until, lambda: all(now.answers > then for now, then in zip(visitors, answers)),
                                            "visitors are served")
            finally:
                for visitor in visitors:
                    visitor.stop()
            self.assertEqual([visitor.failures for visitor in visitors], [[]] * len(visitors))
            await asyncio.wait_for(await watcher.ping(), PATIENCE)
        self.assertNotIn("The certificate stays as it was", server.log())


class PlainPort(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="webots_cloud_plain_port_")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        certbot = Certbot(cls.folder)
        cls.challenges = os.path.join(cls.folder, "challenges")
        os.makedirs(os.path.join(cls.challenges, ".well-known", "acme-challenge"))
        cls.plain = free_port()
        cls.server = cls.enterClassContext(SessionServer([], sslCertificate=certbot.certificate, sslKey=certbot.key, redirectPort=cls.plain,
                                                         challengeFolder=cls.challenges, hostNames=["www.example.org"]))

    def ask(self, target, method="GET", port=None, **headers):
        """Status, headers and body."""
        connection = http.client.HTTPConnection("localhost", port or self.plain, timeout=PATIENCE)
        self.addCleanup(connection.close)
        connection.request(method, target, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read().decode()

    def test_every_request_is_led_to_the_same_address_by_https(self):
        for target in ("/", "/viewer/?url=a%20b&c", "/2000/client", "//elsewhere.example.com/"):
            status, headers, _ = self.ask(target)
            self.assertEqual((status, headers["Location"]), (301, f"https://localhost:{self.server.port}{target}"))
        status, headers, _ = self.ask("/session", method="POST")
        self.assertEqual((status, headers["Location"]), (308, f"https://localhost:{self.server.port}/session"))
        self.assertEqual(self.ask("/", method="HEAD")[0], 301)

    def test_nobody_is_sent_to_a_name_that_is_not_ours(self):
        own = f"https://localhost:{self.server.port}/"
        self.assertEqual(self.ask("/", Host="evil.example.com")[1]["Location"], own)
        self.assertEqual(self.ask("/", Host="www.example.org")[1]["Location"], f"https://www.example.org:{self.server.port}/")

    def test_challenges_of_certbot_are_answered_and_no_other_file_is(self):
        with open(os.path.join(self.challenges, ".well-known", "acme-challenge", "tok-en_1"), "w") as file:
            file.write("tok-en_1.thumbprint")
        status, _, body = self.ask("/.well-known/acme-challenge/tok-en_1")
        self.assertEqual((status, body), (200, "tok-en_1.thumbprint"))
        self.assertEqual(self.ask("/.well-known/acme-challenge/other")[0], 404)
        for target in ("/.well-known/acme-challenge/../../../live/site/privkey.pem", "/.well-known/acme-challenge/%2e%2e/x", "/challenges"):
            status, headers, body = self.ask(target)
            self.assertEqual(status, 301, target)
            self.assertNotIn("PRIVATE", body)

    def test_challenges_are_answered_over_https_as_well(self):
        with open(os.path.join(self.challenges, ".well-known", "acme-challenge", "led_on"), "w") as file:
            file.write("led_on.thumbprint")
        for path, answer in (("led_on", (200, "led_on.thumbprint")), ("other_one", (404, "There is no such challenge."))):
            self.assertEqual(self.server.ask(f"/.well-known/acme-challenge/{path}"), answer)
        self.assertNotIn("PRIVATE", self.server.ask("/.well-known/acme-challenge/%2e%2e/%2e%2e/live/site/privkey.pem")[1])
        self.assertEqual(self.server.ask("/livez"), (200, "alive"))

    def test_a_port_in_use_is_named(self):
        with socket.create_server(("", free_port())) as taken:
            config = {**self.server.config, "redirectPort": taken.getsockname()[1]}
            config.pop("port")
            other = SessionServer([], **config)
            with self.assertRaisesRegex(AssertionError, f"can't listen on port {taken.getsockname()[1]}"):
                try:
                    other.start()
                finally:
                    other.close()

    def test_who_holds_the_plain_port_keeps_nobody_from_the_other(self):
        plain = free_port()
        config = {**self.server.config, "redirectPort": plain}
        config.pop("port")
        server = SessionServer([], **config)
        server.descriptors = 400
        self.enterContext(server)
        silent = []
        self.addCleanup(lambda: [connection.close() for connection in silent])
        for _ in range(500):
            with contextlib.suppress(OSError):
                silent.append(socket.create_connection(("localhost", plain), timeout=PATIENCE))
        for _ in range(20):
            self.assertTrue(shown(server))
            self.assertEqual(self.ask("/", port=plain)[0], 301)

    def test_the_simulation_server_has_such_a_port_too(self):
        plain = free_port()
        with SimulationServer(sslCertificate=self.server.config["sslCertificate"], sslKey=self.server.config["sslKey"],
                              redirectPort=plain) as simulation:
            self.assertEqual(self.ask("/monitor", port=plain)[1]["Location"], f"https://localhost:{simulation.port}/monitor")


class Defaults(unittest.TestCase):
    """What testssl.sh would ask; ciphers and versions are in tls_ciphers_test.py."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="webots_cloud_tls_defaults_")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        certbot = Certbot(cls.folder)
        cls.certificate = certbot.certificate
        cls.server = cls.enterClassContext(SessionServer([], sslCertificate=certbot.certificate, sslKey=certbot.key))

    def client(self, *arguments, said="Q\n"):
        finished = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{self.server.port}", *arguments], input=said, text=True,
                                  capture_output=True, timeout=PATIENCE, env={**os.environ, "OPENSSL_CONF": os.devnull})
        return finished.stdout + finished.stderr

    def test_tls_1_3_is_what_modern_clients_get(self):
        self.assertRegex(self.client(), r"New, TLSv1\.3, Cipher is TLS_AES_256_GCM_SHA384")

    def test_nothing_is_compressed_and_keys_are_exchanged_over_elliptic_curves(self):
        for version in ("-tls1_2", "-tls1_3"):
            said = self.client(version, "-comp")
            self.assertIn("Compression: NONE", said)
            self.assertRegex(said, r"(Server|Peer) Temp Key: (X25519|ECDH)|Negotiated TLS1\.3 group: X25519")
        self.assertIn("Secure Renegotiation IS supported", self.client("-tls1_2"))

    def test_a_connection_ends_with_a_word_so_that_nobody_takes_it_for_cut(self):
        context = ssl.create_default_context(cafile=self.certificate)
        for request in ("GET /session HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n", "GET /session HTTP/1.1\r\n\r\n"):
            with self.subTest(request), socket.create_connection(("localhost", self.server.port), PATIENCE) as plain, \
                    context.wrap_socket(plain, server_hostname="localhost", suppress_ragged_eofs=False) as connection:
                connection.sendall(request.encode())
                while connection.recv(4096):
                    pass

    def test_a_downgrade_is_noticed(self):
        self.assertRegex(self.client("-tls1_1", "-fallback_scsv", "-cipher", "ALL:@SECLEVEL=0"), "alert|no protocols available")
        self.assertRegex(self.client("-tls1_2", "-fallback_scsv"), "inappropriate fallback")

    def test_who_speaks_http_to_the_port_is_told_so(self):
        connection = http.client.HTTPConnection("localhost", self.server.port, timeout=PATIENCE)
        connection.request("GET", "/")
        answer = connection.getresponse()
        self.assertEqual((answer.status, answer.read().decode().split(":")[0]), (400, "This port speaks HTTPS"))
        connection.close()

    def test_a_public_site_without_a_policy_of_origins_is_shown_the_line_to_add(self):
        config = {**self.server.config, "server": "sim.example.org"}
        config.pop("allowedOrigins", None)

        def checked(text):
            path = os.path.join(self.folder, "config.json")
            with open(path, "w") as file:
                file.write(text)
            finished = subprocess.run([program("webots-session-server"), "--check-config", path], capture_output=True, text=True, timeout=PATIENCE)
            return finished.returncode, finished.stdout + finished.stderr

        text = json.dumps(config)
        status, said = checked(text)
        line = re.search(r"add this line: (\"allowedOrigins\": .*,)$", said, re.MULTILINE)
        self.assertEqual(status, 0, said)
        self.assertTrue(line, said)
        status, said = checked(text.replace("{", "{" + line[1], 1))  # as it stands there
        self.assertEqual(status, 0, said)
        self.assertNotIn("pages of every site", said)


if __name__ == "__main__":
    main()
