#!/usr/bin/python3
"""Broken and hostile clients do not affect others: raw sockets, TLS, and limits."""

import asyncio
import contextlib
import json
import os
import re
import resource
import shutil
import signal
import socket
import ssl
import struct
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.certificates import first_words_of_tls  # noqa: E402
from support.raw_websocket import HANDSHAKE, answer_to, close_code, connect, frame, open_websocket, read_all, read_head  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, program, wait_until  # noqa: E402

try:
    from support import web_sockets as websockets
except ImportError as error:
    raise SystemExit(print(f"skipped: {error} (package python3-websockets)") or 77)

def exchange(server, request):
    """Everything that the server answers to some bytes, until it closes the connection."""
    with connect(server) as connection:
        try:
            connection.sendall(request)
        except (ConnectionResetError, BrokenPipeError):
            pass  # it may answer and close before it has heard us out
        return read_all(connection)


class Requests(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = SessionServer([])
        cls.server.__enter__()
        cls.addClassCleanup(cls.server.close)

    def tearDown(self):
        self.assertEqual(self.server.get("/load"), "-1", "everybody else is served")

    def test_each_bad_request_gets_its_status_and_the_connection_is_closed(self):
        for status, request in (
                (414, b"GET /" + b"x" * 9000 + b" HTTP/1.1\r\nHost: localhost\r\n\r\n"),
                (414, b"GET /" + b"x" * 9000),
                (431, b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"x" * 17000 + b"\r\n\r\n"),
                (431, b"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + b"x" * 17000),
                (413, b"POST /session HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n\r\n" + b"x" * 1000000),
                (413, b"POST /session HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n"),
                (400, b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03"),
                (400, os.urandom(5000).replace(b"\r", b"\0")),
                (400, b"GET / HTTP/1.1\r\n\r\n"),
                (400, b"GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n"),
                (400, b"GET /\r\nHost: a\r\n\r\n"),
                (505, b"GET / HTTP/3.0\r\nHost: a\r\n\r\n")):
            with self.subTest(status=status, request=request[:60]):
                answer = exchange(self.server, request)
                self.assertTrue(answer.startswith(b"HTTP/1.1 %d " % status), answer[:100])
                self.assertEqual(answer.count(b"HTTP/1.1 "), 1)

    def test_pipelined_requests_are_answered_in_order(self):
        answer = exchange(self.server, b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\nGET /nope HTTP/1.1\r\nHost: localhost\r\n\r\n"
                                       b"HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\nGET http://other/load HTTP/1.0\r\n\r\nGET /never")
        self.assertEqual(re.findall(rb"HTTP/1.1 (\d+) ", answer), [b"200", b"404", b"200", b"200"])
        self.assertTrue(answer.endswith(b"\r\n\r\n-1"), answer)

    def test_bad_handshakes_get_their_status(self):
        good = HANDSHAKE.format(path="/")
        for status, request in ((400, good.replace("Connection: Upgrade\r\n", "")),
                                (400, re.sub("Sec-WebSocket-Key.*\r\n", "", good)),
                                (426, good.replace("Version: 13", "Version: 99"))):
            answer = exchange(self.server, request.replace("\r\n\r\n", "\r\nConnection: close\r\n\r\n").encode())
            self.assertTrue(answer.startswith(b"HTTP/1.1 %d " % status), answer)
            self.assertEqual(b"\r\nSec-WebSocket-Version: 13\r\n" in answer, status == 426)

    def test_bad_frames_get_their_close_code(self):
        for code, frames in ((1002, frame(0x81, b"x", masked=False)), (1002, frame(0xf1, b"x")), (1002, frame(0x80, b"x")),
                             (1009, frame(0x81, b"x" * 65537)), (1009, frame(0x01, b"x" * 40000) + frame(0x80, b"x" * 40000)),
                             (1009, frame(0x01, b"") + frame(0x00, b"") * 10000), (1007, frame(0x81, b"\xc3\x28"))):
            with self.subTest(code=code, frames=frames[:20]):
                self.assertEqual(close_code(answer_to(self.server, "/", frames)), code)

    def test_a_message_of_64_kib_is_fine_and_a_ping_is_answered(self):
        with open_websocket(self.server) as browser:
            browser.sendall(frame(0x81, b"x" * 65536) + frame(0x89, b"still there"))
            self.assertEqual(browser.recv(3, socket.MSG_WAITALL), b"\x81\x010")
            self.assertEqual(browser.recv(13, socket.MSG_WAITALL), b"\x8a\x0bstill there")
            browser.sendall(frame(0x88, struct.pack("!H", 1000)))
            self.assertEqual(close_code(read_all(browser)), 1000)

    def test_half_sent_requests_end_with_408(self):
        self.assertTrue(exchange(self.server, b"GET /load HTTP/1.1\r\nHost: ").startswith(b"HTTP/1.1 408 "))


class Crowds(unittest.TestCase):
    """More connections than the server has descriptors."""

    def setUp(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        if hard != resource.RLIM_INFINITY and hard < 3000:
            self.skipTest(f"the limit of open files is {hard}")
        resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 5000)), hard))
        self.server = SessionServer([])
        self.server.descriptors = 1024
        self.server.__enter__()
        self.addCleanup(self.server.close)

    def connect(self):
        connection = connect(self.server)
        self.addCleanup(connection.close)
        return connection

    def test_1100_half_sent_requests_make_room_for_whole_ones(self):
        crowd = []
        for _ in range(1100):
            crowd.append(self.connect())
            crowd[-1].sendall(b"GET /session HTTP/1.1\r\nHost: ")
        for _ in range(20):
            self.assertEqual(self.server.get("/session"), "Error: no simulation server available at the moment.")
        self.assertEqual(read_all(crowd[0]), b"", "the oldest made room")
        crowd[-1].sendall(b"localhost\r\nConnection: close\r\n\r\n")
        self.assertTrue(read_all(crowd[-1]).startswith(b"HTTP/1.1 200 "), "the newest is served")

    def test_websockets_are_kept_and_those_who_find_no_room_are_told(self):
        browsers, refused = [], 0
        for _ in range(1100):
            browser = self.connect()
            browser.sendall(HANDSHAKE.format(path="/").encode())
            try:
                head = read_head(browser)
            except ConnectionResetError:
                head = b""
            if head.startswith(b"HTTP/1.1 101 "):
                self.assertEqual(browser.recv(3, socket.MSG_WAITALL), b"\x81\x010")
                browsers.append(browser)
            else:
                self.assertTrue(head == b"" or head.startswith(b"HTTP/1.1 503 "), head)
                refused += 1
        self.assertGreater(len(browsers), 900)
        self.assertGreater(refused, 0)
        for browser in (browsers[0], browsers[-1]):
            browser.sendall(frame(0x89, b"?"))
            self.assertEqual(browser.recv(3, socket.MSG_WAITALL), b"\x8a\x01?")
        browsers[0].close()
        wait_until(lambda: self.server.get("/load") == "-1", "there is room again")


class Limits(unittest.TestCase):
    def address(self):
        """An address of this machine that is not the loopback, which has no limit."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            try:
                probe.connect(("192.0.2.1", 9))  # sends nothing: asks which address would
            except OSError:
                self.skipTest("this machine has no address but the loopback")
            return probe.getsockname()[0]

    def test_connections_over_the_limit_of_an_address_are_refused_and_counted(self):
        address = self.address()
        for server in (SessionServer([], connectionsPerAddress=3), SimulationServer(connectionsPerAddress=3)):
            with self.subTest(server=server.PROGRAM), server:
                admitted = []
                for _ in range(3):
                    admitted.append(socket.create_connection((address, server.port), timeout=PATIENCE))
                    self.addCleanup(admitted[-1].close)
                    admitted[-1].sendall(b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n")
                    self.assertTrue(read_head(admitted[-1]).startswith(b"HTTP/1.1 200 "))
                for _ in range(2):
                    with socket.create_connection((address, server.port), timeout=PATIENCE) as refused:
                        self.assertTrue(read_all(refused).startswith(b"HTTP/1.1 503 "))
                open_now = "\nwebots_http_connections 4\n"  # three, and the one that asks; those before it may take a moment to end
                wait_until(lambda: open_now in server.get("/metrics"), "nobody else is connected")
                figures = server.get("/metrics")
                self.assertIn('\nwebots_http_connections_refused_total{reason="address_limit"} 2\n', figures)
                self.assertNotIn(address, figures)

    def test_what_the_network_did_is_in_the_figures(self):
        with SessionServer([]) as server:
            exchange(server, b"GET /" + b"x" * 9000)
            exchange(server, b"nonsense\r\n\r\n")
            with open_websocket(server) as browser:
                browser.sendall(frame(0x81, b"x", masked=False))
                read_all(browser)
            wait_until(lambda: "\nwebots_http_websockets 0\n" in server.get("/metrics"), "the WebSocket is gone")
            figures = server.get("/metrics")
            for line in ('webots_http_requests_refused_total{reason="long_request_line"} 1',
                         'webots_http_requests_refused_total{reason="malformed"} 1',
                         'webots_http_connections_dropped_total{reason="bad_frame"} 1',
                         "webots_mails_waiting 0", 'webots_mail_attempts_total{result="sent"} 0'):
                self.assertIn(f"\n{line}\n", figures)
            self.assertEqual(len(set(re.findall("# TYPE .*", figures))), len(re.findall("# TYPE .*", figures)))
            for line in figures.splitlines():
                self.assertRegex(line, r'^(# (HELP|TYPE) webots_[a-z_]+ .+|webots_[a-z_]+(\{[a-z_]+="[^"]*"\})? [0-9.e+-]+)$')


class Shutdown(unittest.TestCase):
    def check(self, server, path, number):
        with server, open_websocket(server, path) as browser, connect(server) as half, connect(server) as kept:
            half.sendall(b"GET / HT")
            kept.sendall(b"GET /load HTTP/1.1\r\nHost: localhost\r\n\r\n")
            read_head(kept)
            self.assertEqual(server.stop(number), 0)  # nobody answers the close
            self.assertEqual(close_code(read_all(browser)), 1001)

    def test_the_session_server_ends_with_browsers_that_never_answer(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            self.check(SessionServer([]), "/", number)

    def test_the_simulation_server_ends_with_browsers_that_never_answer(self):
        self.check(SimulationServer(), "/client", signal.SIGTERM)


class Tls(unittest.IsolatedAsyncioTestCase):
    def setUp(self):
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_tls_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.certificate = self.path("certificate.pem")
        self.key = self.path("key.pem")
        self.certify("certificate.pem", "key.pem")

    def path(self, name):
        return os.path.join(self.folder, name)

    def certify(self, certificate, key):
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost",
                        "-out", self.path(certificate), "-keyout", self.path(key)], check=True, capture_output=True)

    def renew(self):
        """Replaces the certificate by another one."""
        self.certify("new_certificate.pem", "new_key.pem")
        os.replace(self.path("new_key.pem"), self.key)
        os.replace(self.path("new_certificate.pem"), self.certificate)

    def server(self, **config):
        return SessionServer([], sslCertificate=self.certificate, sslKey=self.key, **config)

    def context(self, version=None):
        context = ssl.create_default_context(cafile=self.certificate)
        if version:
            context.minimum_version = context.maximum_version = version
        return context

    def shown(self, server):
        """The certificate that new connections get."""
        return ssl.get_server_certificate(("localhost", server.port))

    async def test_http_and_websocket_over_tls_1_2_and_1_3(self):
        with self.server() as server:
            for version in (ssl.TLSVersion.TLSv1_2, ssl.TLSVersion.TLSv1_3):
                context = self.context(version)
                with urllib.request.urlopen(server.url + "/load", context=context, timeout=PATIENCE) as answer:
                    self.assertEqual(answer.read(), b"-1")
                async with websockets.connect(f"wss://localhost:{server.port}/", ssl=context) as browser:
                    self.assertEqual(browser.transport.get_extra_info("ssl_object").version(), version.name.replace("_", "."))
                    self.assertEqual(await browser.recv(), "0")
                    await browser.send("x" * 65536)
                    await asyncio.wait_for(await browser.ping(), PATIENCE)
                    await browser.send("x" * 65537)
                    await asyncio.wait_for(browser.wait_closed(), PATIENCE)
                    self.assertEqual(browser.close_code, 1009)

    async def test_many_requests_and_a_large_answer_over_one_connection(self):
        with self.server() as server:
            with self.context().wrap_socket(connect(server), server_hostname="localhost") as client:
                client.sendall(b"GET /monitor HTTP/1.1\r\nHost: localhost\r\n\r\n" * 200 + b"GET /load HTTP/1.0\r\n\r\n")
                answers = read_all(client)
                self.assertEqual(answers.count(b"HTTP/1.1 200 "), 201)
                self.assertTrue(answers.endswith(b"\r\n\r\n-1"))

    async def test_a_renewed_certificate_is_shown_and_a_broken_one_is_not(self):
        with self.server() as server:
            first = self.shown(server)
            async with websockets.connect(f"wss://localhost:{server.port}/", ssl=self.context()) as browser:
                self.assertEqual(await browser.recv(), "0")
                self.renew()
                wait_until(lambda: self.shown(server) != first, "the renewed certificate is shown")
                second = self.shown(server)
                with open(self.certificate, "w") as file:
                    file.write("broken")
                wait_until(lambda: "The certificate stays as it was: " in server.log(), "the broken one is noticed")
                self.assertEqual(self.shown(server), second)
                self.renew()
                wait_until(lambda: self.shown(server) not in (first, second), "the third one is shown")
                self.assertEqual(server.log().count("The certificate stays as it was: "), 1, server.log())
                os.remove(self.certificate)
                os.mkfifo(self.certificate)  # which nobody writes: it would be waited for
                wait_until(lambda: server.log().count("The certificate stays as it was: ") == 2, "the pipe is noticed")
                self.assertIsNotNone(self.shown(server))
                await asyncio.wait_for(await browser.ping(), PATIENCE)

    async def test_who_does_not_speak_tls_hurts_nobody(self):
        with self.server() as server:
            with connect(server) as silent:
                self.assertNotIn(b"200", exchange(server, b"GET /load HTTP/1.1\r\nHost: localhost\r\n\r\n"))
                exchange(server, os.urandom(3000))
                self.assertEqual(server.get("/load"), "-1")
                self.assertEqual(read_all(silent), b"", "a handshake has a deadline")

    async def test_a_handshake_may_come_byte_by_byte(self):
        incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        client = self.context().wrap_bio(incoming, outgoing, server_hostname="localhost")
        with self.server() as server, connect(server) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            while True:
                try:
                    client.do_handshake()
                    break
                except ssl.SSLWantReadError:
                    for byte in outgoing.read():
                        connection.sendall(bytes([byte]))
                    incoming.write(connection.recv(65536))
            client.write(b"GET /load HTTP/1.0\r\n\r\n")
            connection.sendall(outgoing.read())
            incoming.write(read_all(connection))
            self.assertTrue(client.read(65536).endswith(b"-1"))

    def crowd(self, server, said, connections):
        """900 that have said something, as far as there are any; what memory each takes, in bytes."""
        count = 900  # below "connectionsPerAddress"
        self.assertEqual(server.get("/load"), "-1")
        before, *_ = server.figures()
        for _ in range(count):
            connections.enter_context(connect(server)).sendall(said)
        wait_until(lambda: int(re.search(r"^webots_http_connections (\d+)", server.get("/metrics"), re.MULTILINE)[1]) > count,
                   "all are accepted")
        after, *_ = server.figures()
        return (after - before) * 1024 / count

    async def test_who_says_half_of_a_hello_takes_little_memory(self):
        """docs/machine.md, "How much memory a server takes": with a session of TLS each would take 45 kB."""
        for said in (b"", b"\x16\x03\x01\x02\x00\x01"):
            with self.server() as server, contextlib.ExitStack() as connections:
                if server.is_sanitized():
                    self.skipTest("sanitizers take memory of their own")
                self.assertLess(self.crowd(server, said, connections), 10 * 1024)

    async def test_memory_of_handshakes_is_given_back(self):
        with self.server() as server, contextlib.ExitStack() as connections:
            if server.is_sanitized():
                self.skipTest("sanitizers keep memory")
            before, *_ = server.figures()
            self.crowd(server, first_words_of_tls(), connections)
            wait_until(lambda: server.figures()[0] - before > 30 * 1024, "all have a session of TLS")
            connections.close()
            wait_until(lambda: server.figures()[0] - before < 15 * 1024, "most of the memory is given back")

    async def test_who_speaks_plain_http_to_it_is_told_so(self):
        with self.server() as server:
            for request in (b"GET /load HTTP/1.1\r\nHost: localhost\r\n\r\n", HANDSHAKE.format(path="/").encode(),
                            b"POST /session HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5000\r\n\r\n" + b"x" * 5000):
                answer = exchange(server, request)
                self.assertTrue(answer.startswith(b"HTTP/1.1 400 "), answer)
                self.assertIn(b"This port speaks HTTPS", answer)
            wait_until(lambda: server.log().count("400 for a request without TLS (") == 3, "the log says so")

    async def test_shutdown_closes_with_1001(self):
        with self.server() as server:
            async with websockets.connect(f"wss://localhost:{server.port}/", ssl=self.context()) as browser:
                await browser.recv()
                self.assertEqual(await asyncio.to_thread(server.stop), 0)
                await asyncio.wait_for(browser.wait_closed(), PATIENCE)
                self.assertEqual(browser.close_code, 1001)

    async def test_the_simulation_server_speaks_tls_too(self):
        with SimulationServer(sslCertificate=self.certificate, sslKey=self.key) as server:
            async with websockets.connect(f"wss://localhost:{server.port}/client", ssl=self.context()) as browser:
                await asyncio.wait_for(await browser.ping(), PATIENCE)

    def fails(self, sentence, **config):
        server = SessionServer(["localhost:1"], **config)
        self.addCleanup(server.close)
        with self.assertRaises(AssertionError) as raised:
            server.start()
        lines = str(raised.exception).strip().splitlines()[1:]
        self.assertEqual(len(lines), 1, lines)
        self.assertIn(sentence, lines[0])
        return server.process.returncode

    async def test_unusable_files_are_one_sentence_at_start(self):
        self.certify("other_certificate.pem", "other_key.pem")
        with open(self.path("empty"), "w"):
            pass
        subprocess.run(["openssl", "ec", "-aes128", "-passout", "pass:x", "-in", self.key, "-out", self.path("locked.pem")],
                       check=True, capture_output=True)
        os.mkfifo(self.path("pipe"))
        for certificate, key, sentence in (
                (self.path("pipe"), self.key, "pipe can't be used: it is no regular file"),
                (self.certificate, self.path("pipe"), "pipe can't be used: it is no regular file"),
                ("/dev/zero", self.key, "/dev/zero can't be used: it is no regular file"),
                (self.path("none.pem"), self.key, "none.pem can't be used: No such file or directory"),
                (self.certificate, self.path("none.pem"), "none.pem can't be used: No such file or directory"),
                (self.certificate, self.path("other_key.pem"), f"it is not the key of the certificate {self.certificate}"),
                (self.path("empty"), self.key, "empty can't be used: expected a PEM file with"),
                (self.key, self.key, "can't be used: expected a PEM file with"),
                (self.certificate, self.path("empty"), "empty can't be used: expected a PEM file with a private key"),
                (self.certificate, self.path("locked.pem"), "locked.pem can't be used: expected a PEM file with a private key that has no")):
            with self.subTest(sentence=sentence):
                self.assertEqual(self.fails(sentence, sslCertificate=certificate, sslKey=key), 2)

    async def test_one_key_without_the_other_is_a_wrong_configuration(self):
        self.assertEqual(self.fails('key "sslKey" is missing', sslCertificate=self.certificate), 2)
        self.assertEqual(self.fails('key "sslCertificate" is missing', sslKey=self.key), 2)
        self.assertEqual(self.fails('key "connectionsPerAddress": expected an integer from 1', connectionsPerAddress=0), 2)
        self.assertEqual(self.fails('key "trustedProxies", entry 2: expected an address or a network',
                                    trustedProxies=["::1", "proxy.example.org"]), 2)
        self.assertEqual(self.fails('key "sessionRate": expected 0, or a number from 0.01', sessionRate=-1), 2)

    async def test_a_port_in_use_is_one_sentence_and_status_3(self):
        with SessionServer(["localhost:1"]) as first:
            again = subprocess.run([program("webots-session-server"), os.path.join(first.folder, "config.json")],
                                   capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual((again.returncode, again.stderr.count("\n")), (3, 1), again)
        self.assertIn(f"can't listen on port {first.port}: ", again.stderr)

    async def test_check_config_knows_the_keys(self):
        path = self.path("config.json")
        with open(path, "w") as file:
            json.dump({"port": 1999, "ssl": False, "simulationServers": ["localhost:1"], "sslKey": self.key, "sslCertificate": self.certificate,
                       "connectionsPerAddress": 9}, file)
        checked = subprocess.run([program("webots-session-server"), "--check-config", path], capture_output=True, text=True,
                                 timeout=PATIENCE)
        self.assertEqual(checked.returncode, 0, checked)
        self.assertRegex(checked.stderr, r'^[^\n]*: key "sslCertificate": browsers will not believe it: self-signed certificate [^\n]*\n$')


if __name__ == "__main__":
    main()
