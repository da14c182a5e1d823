#!/usr/bin/python3
"""`--check-config` looks at every folder, port and host that the server would use: what keeps it from starting is an error, everything
else a warning, each with its remedy.

The twin: the Python servers have nothing like it.
"""

import json
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import unittest
from contextlib import closing

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.certificates import Authority, openssl, self_signed  # noqa: E402
from support.name_server import HangingNames  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.servers import PATIENCE, SimulationServer, main, program, without_systemd  # noqa: E402

NOBODY = "r" * 64 + ".example.org"  # too long for any name server, so that none is asked


class Checking(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_check_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.port = free_port(following=3)
        self.file = os.path.join(self.folder, "a_file")
        open(self.file, "w").close()

    environment = {}

    def check(self, server="simulation", prefix=(), **keys):
        """Exit status and standard error of the program."""
        own = {"session": {"simulationServers": ["localhost:1"]}, "simulation": {"forges": [], "notify": [], "maxConnections": 3}}[server]
        config = {"server": "localhost", "ssl": False, "port": self.port, "logDir": "log", **own, **keys}
        with open(os.path.join(self.folder, "c.json"), "w") as file:
            json.dump(config, file)
        environment = {**without_systemd(os.environ), "HOME": self.folder, "TMPDIR": self.folder, "XDG_RUNTIME_DIR": "", "XDG_STATE_HOME": "",
                       "XDG_CACHE_HOME": "", **self.environment, "RES_OPTIONS": "timeout:1 attempts:1"}
        done = subprocess.run([*prefix, program(f"webots-{server}-server"), "--check-config", "c.json"], capture_output=True, text=True, cwd=self.folder,
                              env=environment, timeout=PATIENCE)
        return done.returncode, done.stderr

    def assert_told(self, status, words, **keys):
        """This alone is told."""
        found, said = self.check(**keys)
        self.assertEqual((found, said.count("\n")), (status, 1), said)
        self.assertIn(words, said)
        self.assertEqual(": warning: " in said, status == 0, said)


class Configuration(Checking):
    def test_nothing_is_said_of_a_good_one_and_nothing_is_made(self):
        for server in ("session", "simulation"):
            self.assertEqual(self.check(server), (0, ""))
        self.assertEqual(sorted(os.listdir(self.folder)), ["a_file", "c.json"])

    def test_folders_that_the_server_can_not_do_without(self):
        for server in ("session", "simulation"):
            self.assert_told(2, f'c.json: key "logDir": nothing can be written to {self.file}/{server}: {self.file} is no folder. Let the user',
                             server=server, logDir="a_file")
        self.assert_told(2, 'key "stateDir": nothing can be written to', stateDir=os.path.join(self.file, "state"))

    def test_folders_that_the_server_can_do_without(self):
        self.assert_told(0, 'key "logDir": nothing can be written to', logDir="a_file", debug=True)
        self.assert_told(0, f'key "projectsDir": there is no folder {self.folder}/nowhere: websites have no projects to start from', projectsDir="nowhere")
        self.assert_told(0, f'key "keyDir": the folder {self.folder}/nowhere can\'t be read: No such file or directory. ', keyDir="nowhere")
        for key in ("projectsDir", "keyDir"):
            self.assertEqual(self.check(**{key: self.folder}), (0, ""))

    def test_a_folder_for_temporary_files_that_is_not_there(self):
        self.environment = {"TMPDIR": "/nowhere", "HOME": ""}
        self.assertEqual(self.check(), (0, ""))

    @unittest.skipUnless(os.geteuid() == 0, "only root can be another user")
    def test_a_folder_of_somebody_else(self):
        os.chmod(self.folder, 0o755)
        status, said = self.check(prefix=["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"])
        self.assertEqual(status, 2, said)
        self.assertIn('key "logDir": nothing can be written to', said)
        self.assertIn("Permission denied", said)

    def test_ports(self):
        with closing(socket.create_server(("127.0.0.1", self.port))):
            self.assert_told(0, f"port {self.port}: another program, or a server of another user, listens there. End it", server="session")
        with closing(socket.create_server(("0.0.0.0", self.port + 2))):
            self.assert_told(0, f"ports from {self.port + 1}: 2 of the 3 ports for simulators are free. ")

    def test_a_server_that_runs_has_its_ports(self):
        with SimulationServer(forges=["http://localhost:1"]) as running:
            status, output = running.command("--check-config")
            self.assertEqual(status, 0, output)
            self.assertNotIn("port", output.replace(".json: good", ""))

    def test_a_session_server_of_this_machine_says_how_pages_from_disk_get_in(self):
        configs = os.path.join(os.path.dirname(__file__), "../../config/session")
        note = """Webots' own page is refused when it is opened from disk. To let such pages in, add this line: "allowedOrigins": ["null", "https://webots.cloud"]\n"""
        local = os.path.join(configs, "local.json")
        done = subprocess.run([program("webots-session-server"), "--check-config", local], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(done.stdout, f"{local}: good\n{note}")
        with open(local) as file:
            text = file.read()
        for changes in ({"allowedOrigins": ["null", "https://webots.cloud"]}, {"server": "sim.example.org"}):
            changed = os.path.join(self.folder, "changed.json")
            with open(changed, "w") as file:
                json.dump({**json.loads(text), **changes}, file)
            done = subprocess.run([program("webots-session-server"), "--check-config", changed], capture_output=True, text=True, timeout=PATIENCE)
            self.assertEqual(done.stdout, f"{changed}: good\n", done.stderr)

    def test_names_that_nobody_knows(self):
        for server, key, value in (("session", "simulationServers", [f"{NOBODY}:2000"]), ("simulation", "forges", [f"https://{NOBODY}"]),
                                   ("simulation", "notify", [f"https://{NOBODY}/setup"])):
            self.assert_told(0, f'key "{key}": the name {NOBODY} can\'t be resolved: ', server=server, **{key: value})

    def test_thousands_of_names_are_told_in_a_dozen_lines(self):
        status, said = self.check("session", simulationServers=[f"{i:04}{NOBODY}:2000" for i in range(3000)])
        self.assertEqual((status, said.count("\n")), (0, 11), said)
        self.assertIn("names: 2990 more are not found", said)

    @unittest.skipUnless(os.geteuid() == 0, "only root can have a name server of its own")
    def test_a_name_server_that_says_nothing(self):
        with HangingNames() as names:
            status, said = self.check("session", prefix=names.wrapper, simulationServers=[f"sim{i}.example.org:2000" for i in range(100)])
        self.assertEqual((status, said.count("\n")), (0, 1), said)
        self.assertIn("names: no name server has answered in time for 100 of 101 names. Check /etc/resolv.conf", said)

    def test_a_sandbox_that_is_asked_for_by_name_is_installed(self):
        self.environment = {"PATH": "/nowhere"}
        for name in ("firejail", "bubblewrap"):
            status, said = self.check(sandbox=name)
            self.assertEqual(status, 2, said)
            self.assertRegex(said, f'c.json:1:[0-9]+: key "sandbox": {name} is not installed, and the server does not start without it: apt install')
        self.assertEqual(self.check(sandbox="auto"), (0, ""))

    def test_a_user_of_simulations_that_is_asked_for_by_name_is_there(self):
        status, said = self.check(simulationUser="nobody-here")
        self.assertEqual(status, 2, said)
        self.assertRegex(said, 'c.json:1:[0-9]+: key "simulationUser": this machine has no user "nobody-here", and the server does not start without')
        for name in ("auto", "none", "subordinate", "nobody"):
            self.assertEqual(self.check(simulationUser=name), (0, ""))

    def test_a_configuration_of_the_other_server(self):
        status, said = self.check("simulation", simulationServers=["localhost:2000"])
        self.assertEqual(status, 0)
        self.assertIn('unknown key "simulationServers" is ignored: it belongs into the configuration of webots-session-server', said)

class Certificates(Checking):
    """What the doctor says of them is said here, by a start, and in the log."""

    def check_certificate(self, certificate, key, **more):
        return self.check("session", ssl=True, simulationServers=["localhost:1"], sslCertificate=certificate, sslKey=key, **more)

    def issued(self, *names, trusted=True, **options):
        authority = Authority(self.folder, f"authority {len(os.listdir(self.folder))}")
        self.environment = {"SSL_CERT_FILE": authority.certificate} if trusted else {}
        return authority.issue("own", *(names or ("DNS:localhost",)), **options)

    def test_a_good_one(self):
        self.assertEqual(self.check_certificate(*self.issued(days=60)), (0, ""))

    def test_the_server_starts_with_one_that_browsers_refuse(self):
        for names, options, words in (((), {"days": -1}, "it has expired on"),
                                      ((), {"days": 5}, "valid for 4 days. Renew it now"),
                                      (("DNS:example.org",), {"days": 60}, "it is for example.org, and not for localhost"),
                                      ((), {"days": 60, "trusted": False}, "browsers will not believe it: unable to get local issuer certificate")):
            status, said = self.check_certificate(*self.issued(*names, **options))
            self.assertEqual((status, said.count("\n")), (0, 1), said)
            self.assertRegex(said, 'warning: c.json:1:[0-9]+: key "sslCertificate": ')
            self.assertIn(words, said)

    def test_a_key_of_1024_bits(self):
        certificate, key = (os.path.join(self.folder, name) for name in ("short.pem", "short_key.pem"))
        openssl("req", "-x509", "-newkey", "rsa:1024", "-nodes", "-days", "60", "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost",
                "-keyout", key, "-out", certificate)
        said = self.check_certificate(certificate, key)[1]
        self.assertRegex(said, 'c.json:1:[0-9]+: key "sslCertificate": its key has only 1024 bits, and browsers refuse it. Get one with')

    def test_files_that_are_unusable_are_named_with_their_key_and_its_line(self):
        certificate, key = self.issued(days=60)
        another = self_signed(self.folder, "DNS:localhost")[1]
        for (one, other), name, words in (((certificate, another), "sslKey", "it is not the key of the certificate"),
                                          ((certificate, self.file), "sslKey", "expected a PEM file"),
                                          ((self.file, key), "sslCertificate", "expected a PEM file"),
                                          (("nowhere.pem", key), "sslCertificate", "nowhere.pem can't be used: No such file or directory")):
            status, said = self.check_certificate(one, other)
            self.assertEqual(status, 2, said)
            self.assertRegex(said, f'c.json:1:[0-9]+: key "{name}": .*{words}')

    def test_other_files_too(self):
        for key in ("caFile", "sessionSecret", "operatorTokenFile", "teacherPasswordFile"):
            status, said = self.check("session", **{key: self.file})
            self.assertEqual(status, 2, said)
            self.assertRegex(said, f'c.json:1:[0-9]+: key "{key}": ')
            self.assertIn(self.file, said)

    def test_a_token_that_is_not_there_yet_opens_nothing(self):
        for server in ("session", "simulation"):
            status, said = self.check(server, operatorTokenFile="nowhere")
            self.assertEqual(status, 0, said)
            self.assertRegex(said, f'warning: c.json:1:[0-9]+: key "operatorTokenFile": there is no file {self.folder}/nowhere: nobody is the operator')


if __name__ == "__main__":
    main()
