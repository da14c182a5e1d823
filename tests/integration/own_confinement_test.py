#!/usr/bin/python3
"""The session server can open only the files that it needs (Landlock), and does all its work within them."""

import ctypes
import os
import ssl
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.servers import SessionServer, main, wait_until  # noqa: E402

LANDLOCK_CREATE_RULESET = 444


def setUpModule():
    if ctypes.CDLL(None, use_errno=True).syscall(LANDLOCK_CREATE_RULESET, None, 0, 1) < 1:
        raise unittest.SkipTest("this kernel has no Landlock")


def make_certificate(folder, name):
    """A certificate for `name`; the paths of its files."""
    paths = os.path.join(folder, f"{name}.cert"), os.path.join(folder, f"{name}.key")
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "1",
                    "-subj", f"/CN={name}", "-keyout", paths[1], "-out", paths[0]], check=True, capture_output=True)
    return paths


def shown_certificate(server):
    return ssl.get_server_certificate(("127.0.0.1", server.port))


class Confined(unittest.TestCase):
    def setUp(self):
        context = tempfile.TemporaryDirectory(prefix="webots_cloud_elsewhere_")
        self.addCleanup(context.cleanup)
        self.elsewhere = context.name

    def log(self, server):
        with open(os.path.join(server.folder, "log", "session", "output.log")) as file:
            return file.read()

    def write_token(self, folder):
        path = os.path.join(folder, "token")
        with open(path, "w", opener=lambda name, flags: os.open(name, flags, 0o600)) as file:
            file.write("0123456789abcdef0123")
        return path

    def test_it_logs_and_answers_and_reads_its_configuration_again(self):
        with SessionServer([], debug=False) as server:
            self.assertIn("This server can open only the files that it needs (Landlock).", self.log(server))
            self.assertEqual(server.get("/"), "0")
            self.assertEqual(server.command("--decisions")[0], 0)
            server.reread(viewerUrl="https://github.com/o/r/blob/main/worlds/w.wbt")
            wait_until(lambda: "The configuration was read again" in self.log(server), lambda: self.log(server))
            with open(f"/proc/{server.process.pid}/status") as status:
                self.assertIn("NoNewPrivs:\t1\n", status.read())

    def test_a_new_log_file_is_made_where_the_old_one_was_moved_away(self):
        with SessionServer([], debug=False) as server:
            path = os.path.join(server.folder, "log", "session", "output.log")
            os.rename(path, path + ".old")
            server.stop()
            server.start()
            self.assertIn("Session server running", self.log(server))

    def test_a_certificate_that_was_renewed_by_renaming_is_used(self):
        with tempfile.TemporaryDirectory() as folder:
            first = make_certificate(folder, "first")
            second = make_certificate(folder, "second")
            with SessionServer([], debug=False, sslCertificate=first[0], sslKey=first[1]) as server:
                before = shown_certificate(server)
                os.rename(second[1], first[1])
                os.rename(second[0], first[0])
                wait_until(lambda: shown_certificate(server) != before, lambda: f"the old one is used:\n{self.log(server)}")

    def test_it_can_not_open_a_file_elsewhere(self):
        """Not even as root: here for a new configuration that names one."""
        with SessionServer([], debug=False) as server:
            server.reread(operatorTokenFile=self.write_token(self.elsewhere))
            wait_until(lambda: "Permission denied" in self.log(server), lambda: self.log(server))
            server.stop()
            server.configure(operatorTokenFile=os.path.join(self.elsewhere, "token"))
            server.config["operatorTokenFile"] = os.path.join(self.elsewhere, "token")
            server.start()  # which names it at the start
            server.reread()
            wait_until(lambda: "The configuration was read again" in self.log(server), lambda: self.log(server))


if __name__ == "__main__":
    main()
