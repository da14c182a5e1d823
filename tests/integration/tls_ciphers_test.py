#!/usr/bin/python3
"""Our servers accept only TLS with forward secrecy and authenticated encryption."""

import contextlib
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SessionServer, end, main, wait_until  # noqa: E402

OLD = ":@SECLEVEL=0"  # what a client must say to be allowed to offer old things

if not shutil.which("openssl"):
    raise SystemExit(print("skipped: there is no openssl (package openssl)") or 77)


def certify(folder):
    """A certificate of RSA, which the oldest suites need, and its key."""
    certificate, key = os.path.join(folder, "certificate.pem"), os.path.join(folder, "key.pem")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
                    "-addext", "subjectAltName=DNS:localhost", "-out", certificate, "-keyout", key], check=True, capture_output=True)
    return certificate, key


def accepts_connections(port):
    with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port), timeout=PATIENCE):
        return True
    return False


class Ciphers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="webots_cloud_tls_")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        certificate, key = certify(cls.folder)
        cls.server = SessionServer([], sslCertificate=certificate, sslKey=key)
        cls.server.__enter__()
        cls.addClassCleanup(cls.server.close)

    def handshake(self, *arguments, said="Q\n"):
        """The negotiated cipher, or None; and the whole output of openssl."""
        finished = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{self.server.port}", *arguments], input=said, text=True,
                                  capture_output=True, timeout=PATIENCE, env={**os.environ, "OPENSSL_CONF": os.devnull})
        text = finished.stdout + finished.stderr
        found = re.search(r"^New, \S+, Cipher is (\S+)$", text, re.MULTILINE)
        return (found[1] if found and found[1] != "(NONE)" else None), text

    def test_forward_secrecy_with_authenticated_encryption_is_spoken(self):
        for cipher in ("ECDHE-RSA-AES256-GCM-SHA384", "ECDHE-RSA-AES128-GCM-SHA256", "ECDHE-RSA-CHACHA20-POLY1305"):
            self.assertEqual(self.handshake("-tls1_2", "-cipher", cipher)[0], cipher)
        for cipher in ("TLS_AES_256_GCM_SHA384", "TLS_AES_128_GCM_SHA256", "TLS_CHACHA20_POLY1305_SHA256"):
            self.assertEqual(self.handshake("-tls1_3", "-ciphersuites", cipher)[0], cipher)

    def test_everything_else_is_refused(self):
        for cipher in ("AES128-GCM-SHA256", "AES256-GCM-SHA384", "AES128-SHA", "AES256-SHA256", "kRSA",  # no forward secrecy
                       "ECDHE-RSA-AES128-SHA256", "ECDHE-RSA-AES256-SHA384", "ECDHE-RSA-AES128-SHA",  # no authenticated encryption
                       "DHE-RSA-AES128-GCM-SHA256", "DHE-RSA-AES256-SHA", "NULL", "ADH"):
            agreed, text = self.handshake("-tls1_2", "-cipher", cipher + OLD)
            self.assertIsNone(agreed, cipher)
            self.assertRegex(text, "alert|no cipher match", cipher)
        for version in ("-tls1", "-tls1_1"):
            agreed, text = self.handshake(version, "-cipher", "ALL" + OLD)
            self.assertIsNone(agreed, version)
            self.assertIn("alert protocol version", text)

    def test_the_server_chooses(self):
        order = "ECDHE-RSA-AES128-GCM-SHA256:ECDHE-RSA-AES256-GCM-SHA384"
        self.assertEqual(self.handshake("-tls1_2", "-cipher", order)[0], "ECDHE-RSA-AES256-GCM-SHA384")

    def test_nothing_is_negotiated_twice(self):
        agreed, text = self.handshake("-tls1_2", said="R\n")
        self.assertIsNotNone(agreed)
        self.assertIn("RENEGOTIATING", text)
        self.assertIn("no renegotiation", text)


class OldPeers(unittest.TestCase):
    """Requests of our own servers to a machine that only speaks TLS 1.1, on a system whose OpenSSL allows that."""

    CONFIGURATION = ("openssl_conf = all\n[all]\nssl_conf = tls\n[tls]\nsystem_default = old\n"
                     "[old]\nMinProtocol = TLSv1\nCipherString = ALL:@SECLEVEL=0\n")

    def problem_with(self, *version):
        """Why the session server can't use the machine."""
        folder = tempfile.mkdtemp(prefix="webots_cloud_tls_")
        self.addCleanup(shutil.rmtree, folder)
        certificate, key = certify(folder)
        with open(os.path.join(folder, "openssl.cnf"), "w") as file:
            file.write(self.CONFIGURATION)
        environment = {"OPENSSL_CONF": file.name, "SSL_CERT_FILE": certificate}
        port = free_port()
        said = self.enterContext(open(os.path.join(folder, "openssl.log"), "w"))
        machine = subprocess.Popen(["openssl", "s_server", "-accept", f"127.0.0.1:{port}", "-cert", certificate, "-key", key, "-www",
                                    "-cipher", "ALL:@SECLEVEL=0", *version], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                   stderr=said, env={**os.environ, **environment})
        self.addCleanup(end, machine)
        # The first problem of a machine is the one that is logged: it must not be that nobody listens yet.
        wait_until(lambda: accepts_connections(port), lambda: f"openssl s_server: exit status {machine.poll()}, {open(said.name).read()}")
        with SessionServer([f"localhost:{port}"], environment=environment, ssl=True) as server:
            found = wait_until(lambda: re.search(r"TLS failed: .*|the load must be a number.*|HTTP 404.*", server.log()), server.log)
            return found[0]

    def test_what_is_older_than_tls_1_2_is_not_spoken_to(self):
        self.assertIn("TLS failed", self.problem_with("-tls1_1"))
        self.assertNotIn("TLS failed", self.problem_with("-tls1_2"))


if __name__ == "__main__":
    main()
