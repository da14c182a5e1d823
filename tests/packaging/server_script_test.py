#!/usr/bin/python3
"""Drives server.sh with the real servers, in a folder of its own; only the build is left out, for the programs are built.

Usage: server_script_test.py PATH_OF_SERVER_SH FOLDER_OF_PROGRAMS
"""

import datetime
import json
import os
import re
import shutil
import signal
import socket
import ssl
import stat
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.certificates import Authority  # noqa: E402
from support.disks import mount_small_disk  # noqa: E402
from support.machine import Machine  # noqa: E402
from support.ports import free_port  # noqa: E402
from support.waiting import wait_until  # noqa: E402

SCRIPT, PROGRAMS = "", ""
PATIENCE_SECONDS = 30


def is_running(pid):
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().rpartition(")")[2].split()[0] not in "ZX"
    except OSError:
        return False


class ServerScriptTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="webots_cloud_script_")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.ports = {"session": free_port(), "simulation": free_port(following=100)}
        shutil.copy(SCRIPT, self.folder)
        for name in ("build", "package"):
            self.write(f"cmake/packages/{name}.txt", "# the programs are built\n")
        shutil.copy(os.path.join(os.path.dirname(SCRIPT), "cmake/packages/install.sh"), self.path("cmake/packages"))
        for place in ("src/web/view", "build/node/src/web/view", "src/web/class", "build/node/src/web/class"):  # are installed
            self.write(f"{place}/package-lock.json", "{}\n")
        self.write("bin/cmake", "#!/bin/sh\nexit 0\n")
        os.chmod(self.path("bin/cmake"), 0o755)
        os.makedirs(self.path("build/release"))
        os.symlink(PROGRAMS, self.path("build/release/bin"))
        os.makedirs(self.path("tmp"))
        self.configure("local")
        self.addCleanup(self.run_script, "stop")

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "w") as file:
            file.write(text)

    def read(self, name):
        with open(self.path(name)) as file:
            return file.read()

    def configure(self, name, kinds=("session", "simulation"), **more):
        # The machine that runs the tests may be busy: that is not what most of them are about.
        settings = {"session": {"simulationServers": [f"localhost:{self.ports['simulation']}"], "loadThreshold": 1000}, "simulation": {}}
        for kind in kinds:
            config = {"server": "localhost", "ssl": False, "portRewrite": False, "port": self.ports[kind]}
            self.write(f"config/{kind}/{name}.json", json.dumps({**config, **settings[kind], **more}, indent=2))

    def environment(self):
        return {"PATH": f"{self.path('bin')}:{os.environ['PATH']}", "HOME": self.path("tmp"), "TMPDIR": self.path("tmp")}

    def run_script(self, *arguments, command=("./server.sh",), user=None, walls=False):
        """Returns exit status, standard output and standard error; without what is said of the walls that this machine can't make."""
        done = subprocess.run([*command, *arguments], cwd=self.folder, env=self.environment(), text=True, timeout=120, user=user,
                              stdin=subprocess.DEVNULL, capture_output=True)
        said = done.stdout if walls else re.sub(r"(?m)^(Warning: (?!config/)|  warning  ).*\n", "", done.stdout)
        return done.returncode, said, done.stderr

    def pid(self, kind):
        with open(self.path(f"log/.{kind}.pid")) as file:
            return int(file.read())

    def start(self, name="local"):
        status, output, errors = self.run_script("start", name)
        self.assertEqual((status, errors), (0, ""), output)
        return output

    def get(self, kind, path):
        with urllib.request.urlopen(f"http://localhost:{self.ports[kind]}{path}", timeout=PATIENCE_SECONDS) as answer:
            return answer.read().decode()


class Starting(ServerScriptTest):
    def test_a_start_names_the_servers_and_the_address_at_which_they_answer(self):
        output = self.start()
        self.assertEqual(output.splitlines(), [
            f"Started local simulation server ({self.pid('simulation')})",
            f"Started local session server ({self.pid('session')})",
            f"Open http://localhost:{self.ports['session']}/"])
        self.assertIn("<html", self.get("session", "/viewer/"))
        self.assertGreaterEqual(float(self.get("simulation", "/load")), 0)
        self.assertEqual(self.get("session", "/session"), f"ws://localhost:{self.ports['simulation']}")  # the first click

    # As Ninja does, which cmake runs.
    def build_says(self, *lines, status=0):
        said = "".join(f"echo '{line}'\n" for line in lines)
        self.write("bin/cmake", f'#!/bin/sh\n[ "$1" = --build ] || exit 0\n{said}exit {status}\n')

    def test_a_build_is_a_few_lines_and_the_rest_is_in_its_log(self):
        steps = [f"[{step}/100] Building CXX object {step}.o" for step in range(101)]
        self.build_says(*steps)
        self.assertEqual(self.start().splitlines()[:-3], [f"Building: step {step} of 100" for step in (25, 50, 75, 100)])
        with open(self.path("build/release/build.log")) as log:
            self.assertEqual(log.read().splitlines(), steps)

    def test_what_is_built_may_be_run_by_the_users_of_simulations_whatever_the_shell_takes_from_new_files(self):
        self.write("bin/cmake", "#!/bin/sh\numask >>masks\n")
        status, output, errors = self.run_script("start", command=("bash", "-c", 'umask 077; ./server.sh "$@"', "bash"))
        self.assertEqual((status, errors), (0, ""), output)
        self.assertEqual(set(self.read("masks").split()), {"0022"})
        self.assertEqual(stat.S_IMODE(os.stat(self.path("log")).st_mode), 0o700)  # which is the operator's

    def test_a_build_counts_its_steps_in_one_line_of_a_terminal(self):
        self.build_says(*[f"[{step}/100] Building CXX object {step}.o" for step in range(101)])
        seen = subprocess.run(["script", "--quiet", "--return", "--command", "./server.sh start", "/dev/null"], cwd=self.folder,
                              env=self.environment(), timeout=120, stdin=subprocess.DEVNULL, capture_output=True)
        self.assertEqual(seen.returncode, 0, seen.stdout)
        line = re.match(rb"(\rBuilding: step (\d+) of 100\x1b\[K)+\r*\n", seen.stdout)
        self.assertTrue(line and line[2] == b"100", seen.stdout)
        self.assertNotIn(b"Building", seen.stdout[line.end():])

    def test_a_build_that_fails_shows_what_the_compiler_complains_of(self):
        self.build_says("[1/2] Building CXX object a.o", "FAILED: b.o", "/usr/bin/c++ -c b.cpp", "b.cpp:1:1: error: no such thing",
                        "[2/2] Building CXX object c.o", "ninja: build stopped: subcommand failed.", status=1)
        status, output, errors = self.run_script("start")
        self.assertEqual((status, errors.splitlines()), (1, [
            "FAILED: b.o", "b.cpp:1:1: error: no such thing", "ninja: build stopped: subcommand failed.",
            "The build failed. All that it said is in build/release/build.log."]), output)
        self.assertNotIn("Started", output)

    def test_a_build_that_lacks_memory_says_so(self):
        self.build_says("FAILED: b.o", "/usr/bin/c++ -c b.cpp", "c++: fatal error: Killed signal terminated program cc1plus", status=1)
        status, _, errors = self.run_script("start")
        self.assertEqual(status, 1)
        self.assertIn("too little memory", errors)

    # A build has just kept the machine busy: the first click would be refused.
    def test_a_start_waits_until_a_machine_is_free(self):
        with Machine(load="100.0") as machine:
            self.write("config/session/local.json", json.dumps(
                {"server": "localhost", "ssl": False, "portRewrite": False, "port": self.ports["session"], "loadRefresh": 0.2,
                 "simulationServers": [machine.address]}, indent=2))
            script = subprocess.Popen(["./server.sh", "start"], cwd=self.folder, env=self.environment(), text=True,
                                      stdin=subprocess.DEVNULL, stdout=subprocess.PIPE)
            with script:
                said = [script.stdout.readline() for _ in range(3)]
                self.assertEqual(said[2], "Waiting until a simulation server is free\n", said)
                self.assertTrue(self.get("session", "/session").startswith("Error: "))
                machine.load = "1.0"
                self.assertEqual(script.stdout.read(), f"Open http://localhost:{self.ports['session']}/\n")
            self.assertEqual(script.returncode, 0)
            self.assertEqual(self.get("session", "/session"), f"ws://{machine.address}")

    def test_a_second_start_leaves_the_servers_as_they_are(self):
        self.start()
        pids = self.pid("simulation"), self.pid("session")
        self.assertEqual(self.start().splitlines(), [
            f"The local simulation server is already running ({pids[0]})",
            f"The local session server is already running ({pids[1]})",
            f"Open http://localhost:{self.ports['session']}/"])
        self.assertEqual((self.pid("simulation"), self.pid("session")), pids)

    def test_a_start_replaces_only_the_server_that_died(self):
        self.start()
        alive, dead = self.pid("simulation"), self.pid("session")
        os.kill(dead, signal.SIGKILL)
        wait_until(lambda: not is_running(dead), "the killed server is still there")
        output = self.start()
        self.assertIn(f"The local simulation server is already running ({alive})", output)
        self.assertIn(f"Started local session server ({self.pid('session')})", output)

    def test_only_the_kinds_that_are_configured_are_started(self):
        self.configure("machine", kinds=["simulation"])
        self.assertEqual(self.start("machine"), f"Started machine simulation server ({self.pid('simulation')})\n")
        self.assertFalse(os.path.exists(self.path("log/.session.pid")))

    def configure_lan(self):
        self.configure("lan", kinds=["session"], server="*", portRewrite=True,
                       simulationServers=[{"address": f"*/{self.ports['simulation']}", "internal": f"127.0.0.1:{self.ports['simulation']}"}],
                       teacherPasswordFile="log/.teacher-password")
        self.configure("lan", kinds=["simulation"], server="*", portRewrite=True, listenAddress="127.0.0.1")

    def fake(self, name, text):
        self.write(f"bin/{name}", f"#!/bin/bash\n{text}\n")
        os.chmod(self.path(f"bin/{name}"), 0o755)

    @unittest.skipIf(os.geteuid() != 0 or not shutil.which("ip"), "only root can make networks, with ip (package iproute2)")
    def test_a_site_for_the_network_names_the_addresses_for_its_other_machines(self):
        self.configure_lan()
        port = self.ports["session"]
        ask = f"http://127.0.0.1:{port}/session"
        network = ("unshare", "--net", "bash", "-ec", "ip link set lo up; ip address add 192.168.7.5/24 dev lo; ip address add 169.254.1.2/16 dev lo;"
                   f"./server.sh \"$@\"; python3 -c 'import urllib.request as u; print(u.urlopen(\"{ask}\").read().decode())'", "bash")
        status, output, errors = self.run_script("start", "--lan", command=network)
        self.assertEqual((status, errors), (0, ""), output)
        password = self.read("log/.teacher-password").strip()
        self.assertRegex(password, "^[a-hjkmnp-z]{4}-[a-hjkmnp-z]{4}-[a-hjkmnp-z]{4}$")
        self.assertEqual(os.stat(self.path("log/.teacher-password")).st_mode & 0o777, 0o600)
        self.assertEqual(output.splitlines()[2:], [
            f"Open http://localhost:{port}/",
            f"From other machines of the network: http://192.168.7.5:{port}/",
            f"If they can't reach it, a firewall keeps them out: port {port} has to be open.",
            f"For a class: http://192.168.7.5:{port}/class/",
            f"Password of teachers: {password} (in log/.teacher-password)",
            f"ws://127.0.0.1:{port}/{self.ports['simulation']}"])
        status, said, _ = self.run_script("start", "lan", command=("unshare", "--net", "./server.sh"))
        self.assertEqual(status, 0)
        self.assertIn("This machine is in no network: others can't reach it.", said)
        self.assertTrue(said.endswith(f"For a class: http://localhost:{port}/class/\n"
                                      f"Password of teachers: {password} (in log/.teacher-password)\n"), said)

    def configure_shipped(self):
        """config/*/local.json and lan.json of the repository, at other ports."""
        repository = os.path.dirname(SCRIPT)
        os.symlink(os.path.join(repository, "examples"), self.path("examples"))
        for kind in ("session", "simulation"):
            for name in ("local", "lan"):
                with open(os.path.join(repository, "config", kind, f"{name}.json")) as file:
                    text = file.read()
                for port, other in ((1999, self.ports["session"]), (2000, self.ports["simulation"])):
                    text = text.replace(str(port), str(other))
                self.write(f"config/{kind}/{name}.json", text)

    def test_a_plain_start_is_for_this_machine_and_says_how_others_get_in(self):
        self.configure_shipped()
        self.assertIn("Only browsers on this machine reach it. For others in the network: ./server.sh restart --lan\n", self.start())
        for port in self.ports.values():
            with self.assertRaises(ConnectionRefusedError):  # every address of the machine but one
                socket.create_connection(("127.0.0.2", port), timeout=PATIENCE_SECONDS).close()
        status, output, errors = self.run_script("restart", "--lan")
        self.assertEqual((status, errors), (0, ""))
        self.assertNotIn("Only browsers on this machine", output)
        socket.create_connection(("127.0.0.2", self.ports["session"]), timeout=PATIENCE_SECONDS).close()

    def test_walls_that_can_not_be_made_are_told_when_and_where_people_look(self):
        for name in ("bwrap", "firejail"):
            self.fake(name, "exit 1")
        status, output, errors = self.run_script("start", walls=True)
        self.assertEqual((status, errors), (0, ""), output)
        self.assertRegex(output, r"(?m)^Warning: (.* )?Simulations run without a sandbox, and can read .*bubblewrap")
        self.assertRegex(self.run_script("status", walls=True)[1], r"(?m)^  warning        (.* )?Simulations run without a sandbox")
        self.assertIn("Simulations run without a sandbox", self.get("simulation", "/readyz"))
        self.assertIn("Simulations run without a sandbox", self.get("simulation", "/monitor"))

    def test_neither_ip_nor_awk_nor_getconf_are_needed(self):
        for name in ("ip", "awk", "getconf", "hostname", "setsid", "timeout", "ps"):
            self.fake(name, "exit 127")
        self.configure_lan()
        output = self.start("--lan")
        self.assertRegex(output, "From other machines of the network: http://|This machine is in no network: others")
        status, output, errors = self.run_script("status")
        self.assertEqual((status, errors), (0, ""))
        self.assertRegex(output, r"The session server runs since \d{4}-\d\d-\d\d \d\d:\d\d:\d\d ")
        self.assertEqual(self.run_script("stop")[::2], (0, ""))

    # As `./server.sh start | head -1`, and from programs that give it no outputs.
    def test_a_start_that_nobody_listens_to_is_complete_even_so(self):
        self.build_says(*[f"[{step}/4] Building CXX object {step}.o" for step in range(5)])
        for closing in (">&-", ">&- 2>&-", "| head -n 1", "2>&1 | true"):
            status, output, errors = self.run_script("start", command=("bash", "-c", f'set -o pipefail; ./server.sh "$@" {closing}', "bash"))
            self.assertEqual((status, errors), (0, ""), closing + output)
            self.assertTrue(is_running(self.pid("session")) and is_running(self.pid("simulation")), closing)
            self.assertIn("<html", self.get("session", "/viewer/"))
            self.assertEqual(self.run_script("stop")[0], 0)

    def test_a_start_asks_its_servers_so_that_they_have_nothing_to_complain_of(self):
        sites = {"local": self.start}
        if shutil.which("openssl"):
            self.configure_tls_site()
            sites["tls"] = lambda: self.start("tls")
        for name, start in sites.items():
            start()
            self.assertEqual(self.run_script("status")[0], 0)
            self.assertEqual(self.run_script("stop")[0], 0)
            for kind in ("session", "simulation"):
                log = self.read(f"log/{kind}/output.log")
                self.assertNotRegex(log, r"(?i)handshake|request.*(127\.0\.0\.1|::1)", f"{name} {kind}")
                self.assertIn("Ending, as SIGTERM asks", log)

    def configure_neighbours(self):
        """Both servers at ports beside each other, as those that ship. Returns a port to which they can be moved."""
        base = free_port(following=102)
        self.ports = {"session": base, "simulation": base + 1}
        self.configure("local")
        return free_port(following=102)

    def test_one_option_moves_a_site_to_other_ports(self):
        port = self.configure_neighbours()
        status, output, errors = self.run_script("start", "--port", str(port))
        self.assertEqual((status, errors), (0, ""), output)
        self.assertIn(f"Open http://localhost:{port}/\n", output)
        before = self.ports["session"]
        self.ports = {"session": port, "simulation": port + 1}
        self.assertEqual(self.get("session", "/session"), f"ws://localhost:{port + 1}")
        self.assertGreaterEqual(float(self.get("simulation", "/load")), 0)
        status, output, _ = self.run_script("status")
        self.assertIn(f"  configuration  config/session/local.json, its ports moved by {port - before}\n"
                      f"  address        http://localhost:{port}/\n", output)
        self.assertIn(f"Open http://localhost:{port}/\n", self.start())  # it stays where it is
        status, _, errors = self.run_script("start", "--port", str(before))
        self.assertEqual(status, 1)
        self.assertIn(f"runs with config/simulation/local.json on port {port + 1}: stop it first, or use restart.", errors)
        self.assertIn(f"Open http://localhost:{before}/\n", self.run_script("restart", "--port", str(before))[1])

    def test_the_address_behind_a_proxy_is_the_public_one(self):
        self.configure("public", kinds=["session"], ssl=True, portRewrite=True, server="sim.example.org")
        self.assertIn(f"Open https://sim.example.org/{self.ports['session']}/\n", self.start("public"))

    def test_servers_that_speak_tls_are_seen_to_answer(self):
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        certificate, key = self.path("tmp/certificate.pem"), self.path("tmp/key.pem")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
                        "-keyout", key, "-out", certificate, "-days", "2", "-subj", "/CN=localhost"], check=True, capture_output=True)
        self.configure("local", ssl=True, sslCertificate=certificate, sslKey=key)
        status, output, errors = self.run_script("start")
        self.assertEqual(status, 0, output + errors)
        self.assertIn(f"Open https://localhost:{self.ports['session']}/\n", output)

    def configure_tls_site(self):
        """config/*/tls.json of the repository, on other ports."""
        self.ports["plain"] = free_port()
        repository = os.path.dirname(SCRIPT)
        settings = {}
        for kind in ("session", "simulation"):
            with open(os.path.join(repository, "config", kind, "tls.json")) as file:
                settings[kind] = json.load(file)
        os.symlink(os.path.join(repository, "examples"), self.path("examples"))
        public = f"localhost:{self.ports['session']}"
        self.assertEqual((settings["session"]["port"], settings["session"]["redirectPort"]), (443, 80))
        settings["session"].update(port=self.ports["session"], redirectPort=self.ports["plain"], loadThreshold=1000, simulationServers=[
            {"address": f"{public}/{self.ports['simulation']}", "internal": f"127.0.0.1:{self.ports['simulation']}"}])
        settings["simulation"].update(port=self.ports["simulation"], server=public)
        for kind, each in settings.items():
            self.write(f"config/{kind}/tls.json", json.dumps(each, indent=2))

    def test_a_site_with_tls_is_complete_and_its_first_certificate_is_made(self):
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        self.configure_tls_site()
        output = self.start("tls")
        made = "Made tls/certificate.pem for localhost, valid for a year. Nobody vouches for it, so browsers warn: " \
               "replace it and tls/key.pem by real ones."
        lines = output.splitlines()
        self.assertRegex(lines.pop(1), r'^Warning: config/session/tls.json:\d+:\d+: key "sslCertificate": browsers will not believe it: self-signed certificate')
        self.assertEqual(lines, [made, f"Started tls simulation server ({self.pid('simulation')})",
                                 f"Started tls session server ({self.pid('session')})",
                                 f"Open https://localhost:{self.ports['session']}/",
                                 "The operator's token, for the button Operator of the monitor: in log/.operator-token"])
        self.assertEqual(stat.S_IMODE(os.stat(self.path("tls/key.pem")).st_mode), 0o600)
        site = f"https://localhost:{self.ports['session']}"
        trust = ssl.create_default_context(cafile=self.path("tls/certificate.pem"))

        def get(address):
            with urllib.request.urlopen(address, timeout=PATIENCE_SECONDS, context=trust) as answer:
                return answer.read().decode()
        self.assertIn("<html", get(f"{site}/viewer/"))
        self.assertIn("<html", get(f"http://localhost:{self.ports['plain']}/viewer/"))  # is led to the other
        self.assertEqual(get(f"{site}/session"), f"wss://localhost:{self.ports['session']}")  # it relays
        self.assertGreaterEqual(float(get(f"{site}/{self.ports['simulation']}/load")), 0)
        status, output, errors = self.run_script("status")
        self.assertEqual((status, errors), (0, ""))
        self.assertIn(f"  address        {site}/\n", output)
        self.assertNotIn("does not answer", output)
        self.assertNotIn("Made", self.run_script("restart", "tls")[1])

    def test_a_certificate_that_has_expired_is_told_by_the_start_and_by_the_log(self):
        if not shutil.which("openssl"):
            self.skipTest("openssl is missing (package openssl)")
        certificate, key = Authority(self.path("tmp"), "an authority").issue("own", "DNS:localhost", days=-1)
        self.configure("local", kinds=["session"], ssl=True, sslCertificate=certificate, sslKey=key)
        os.remove(self.path("config/simulation/local.json"))
        output = self.start()
        told = re.search(r'Warning: (config/session/local.json:\d+:\d+: key "sslCertificate": it has expired on .*)\n', output)
        self.assertTrue(told, output)
        self.assertIn(told[1], self.read("log/session/output.log"))

    def test_the_operators_token_is_made_once_and_opens_both_monitors(self):
        for kind in ("session", "simulation"):
            self.configure("local", kinds=[kind], operatorTokenFile="log/.operator-token")
        output = self.start()
        self.assertTrue(output.endswith("The operator's token, for the button Operator of the monitor: in log/.operator-token\n"), output)
        self.assertEqual(stat.S_IMODE(os.stat(self.path("log/.operator-token")).st_mode), 0o600)
        token = self.read("log/.operator-token").strip()
        self.assertNotIn(token, output)
        self.assertRegex(token, "^[0-9a-f]{32}$")
        for kind in ("session", "simulation"):
            request = urllib.request.Request(f"http://localhost:{self.ports[kind]}/api/operator", headers={"Authorization": f"Bearer {token}"})
            with urllib.request.urlopen(request, timeout=PATIENCE_SECONDS) as answer:
                self.assertEqual(answer.read(), b"operator")
        self.run_script("restart")
        self.assertEqual(self.read("log/.operator-token").strip(), token)

    def test_what_is_odd_is_told_by_the_start(self):
        self.configure("local", kinds=["session"], viewerUrl="hello")
        self.assertIn('key "viewerUrl": "hello" is no address of a world', self.start())

    def test_no_certificate_is_made_beside_half_of_one_or_in_a_folder_of_others(self):
        self.configure_tls_site()
        self.write("tls/key.pem", "somebody's")
        status, output, errors = self.run_script("start", "tls")
        self.assertEqual((status, output), (1, ""))
        self.assertIn("the certificate tls/certificate.pem can't be used: No such file or directory", errors)
        self.configure("certbot", sslCertificate=self.path("live/fullchain.pem"), sslKey=self.path("live/privkey.pem"))
        self.assertEqual(self.run_script("start", "certbot")[0], 1)
        self.assertFalse(os.path.exists(self.path("live")))

    def test_the_website_is_started_and_stopped_with_the_others(self):
        port = free_port()
        self.write("config/website_host/local.json", json.dumps({
            "port": port, "keyFile": "website/key/localhost", "usersDir": "website/user",
            "pageDir": os.path.join(os.path.dirname(SCRIPT), "examples", "website_host", "page"),
            "projects": [{"name": "robots", "world": "arena.wbt", "controller": "avoid_walls"}]}))
        status, output, errors = self.run_script("start")
        self.assertEqual((status, errors), (0, ""))
        self.assertEqual(output.splitlines()[0], f"Started local website host ({self.pid('website_host')})")
        self.assertEqual(output.splitlines()[-1], f"A website with an editor: http://localhost:{port}/")
        with urllib.request.urlopen(f"http://localhost:{port}/", timeout=PATIENCE_SECONDS) as page:
            self.assertIn("<html", page.read().decode())
        pid = self.pid("website_host")
        self.assertEqual(self.run_script("stop")[1].splitlines()[-1], f"Stopped website host ({pid})")
        self.assertFalse(is_running(pid))

    def test_servers_hold_nothing_of_the_terminal_that_started_them(self):
        self.start()
        for kind in ("session", "simulation"):
            pid = self.pid(kind)
            if os.geteuid() == 0:  # nobody else may look
                self.assertEqual(os.readlink(f"/proc/{pid}/fd/0"), "/dev/null")
                self.assertEqual(os.readlink(f"/proc/{pid}/fd/1"), self.path(f"log/{kind}/console.log"))
            self.assertEqual(os.getsid(pid), pid)


    def test_signals_that_are_ignored_where_it_is_typed_are_nobodys_loss(self):
        status, output, errors = self.run_script("start", command=("bash", "-c", 'trap "" HUP INT TERM CHLD PIPE USR1; ./server.sh "$@"', "bash"))
        self.assertEqual((status, errors), (0, ""), output)
        self.assertEqual(self.run_script("stop")[0], 0)

    # Simulations run as the user who calls the script, and may have put anything into the folder of logs.
    def test_pipes_and_links_in_the_place_of_its_files_are_set_aside(self):
        self.write("victim", "precious")
        os.makedirs(self.path("log/simulation"))
        os.mkfifo(self.path("log/simulation/console.log"))
        os.mkfifo(self.path("log/.simulation.pid"))
        os.symlink(self.path("victim"), self.path("log/.session.pid"))
        os.symlink(self.path("victim"), self.path("log/.server.lock"))
        status, _, errors = self.run_script("start")
        self.assertEqual(status, 0, errors)
        for name in ("simulation/console.log", ".simulation.pid", ".session.pid", ".server.lock"):
            self.assertIn(f"log/{name} was not what it has to be, and is now log/{name}.set-aside-", errors)
        with open(self.path("victim")) as file:
            self.assertEqual(file.read(), "precious")


class Refusing(ServerScriptTest):
    def test_an_unknown_name_is_refused_and_the_files_that_it_needs_are_named(self):
        status, _, errors = self.run_script("start", "nowhere")
        self.assertEqual(status, 1)
        self.assertIn("config/session/nowhere.json", errors)

    def test_a_port_in_use_is_named(self):
        for kind in ("session", "simulation"):
            with socket.create_server(("127.0.0.1", self.ports[kind])):
                status, output, errors = self.run_script("start")
            self.assertEqual((status, output), (1, ""))  # nothing has been started
            with open("/proc/self/cmdline") as words:
                program = os.path.basename(words.read().partition("\0")[0])
            self.assertIn(f"Port {self.ports[kind]} is in use by another program, {program} ({os.getpid()}): local {kind} server not started. ",
                          errors)
            self.assertIn('End it; or move the whole site with ./server.sh start --port ', errors)
            self.assertIn(f'or change "port" in config/{kind}/local.json', errors)
            self.assertEqual(' and "simulationServers" in config/session/local.json.' in errors, kind == "simulation", errors)
            self.assertEqual(self.run_script("status")[0], 3)

    def test_a_port_in_use_anywhere_is_noticed(self):
        for address in ("::", "127.0.0.1"):
            self.configure("local", kinds=("session",), listenAddress=address)
            with socket.socket(socket.AF_INET6) as other:
                try:
                    other.bind(("::1", self.ports["session"]))
                except OSError:
                    self.skipTest("this machine has no IPv6")
                other.listen()
                status, _, errors = self.run_script("start")
            self.assertEqual(status, 1, address)
            self.assertIn(f"Port {self.ports['session']} is in use", errors)

    def test_a_machine_without_a_port_for_any_simulation_is_not_started(self):
        self.configure("local", kinds=("simulation",), maxConnections=2)
        first = self.ports["simulation"] + 1
        with socket.create_server(("", first)), socket.create_server(("", first + 1)):
            status, _, errors = self.run_script("start")
        self.assertEqual(status, 1)
        self.assertTrue(errors.startswith(f"All ports of simulations, {first} to {first + 1}, are in use by other programs: local simulation server not started. "
                                          "End these programs; or move the whole site with ./server.sh start --port "), errors)
        with socket.create_server(("", first)):
            self.start()  # others can run

    def test_an_address_of_another_machine_is_told(self):
        self.configure("local", listenAddress="192.0.2.1")
        status, _, errors = self.run_script("start")
        self.assertEqual(status, 1)
        self.assertRegex(errors.splitlines()[0], r"192\.0\.2\.1 is none of this machine's addresses now\. `ip address` shows them: name one of them")

    def test_a_site_of_another_checkout_is_told_with_the_command_that_stops_it(self):
        other = self.path("other checkout")
        shutil.copytree(self.folder, other, symlinks=True, ignore=lambda folder, names: [os.path.basename(other), "log", "tmp"])
        self.start()
        status, output, errors = self.run_script("start", command=(os.path.join(other, "server.sh"),))
        self.assertEqual((status, output), (1, ""))
        self.assertIn(f"Port {self.ports['simulation']} is in use by a simulation server of {self.folder} ({self.pid('simulation')}): "
                      f"local simulation server not started. Stop it with {self.folder}/server.sh stop; or move ", errors)
        for verb, expected in (("stop", 0), ("status", 3)):  # nothing of it is touched
            self.assertEqual(self.run_script(verb, command=(os.path.join(other, "server.sh"),)), (expected, "No server is running\n", ""))
        self.assertTrue(is_running(self.pid("session")) and is_running(self.pid("simulation")))

    def test_a_start_that_fails_leaves_nothing_half_started(self):
        self.configure("local", kinds=("session",), logDir="/proc/nowhere")
        status, output, errors = self.run_script("start")
        self.assertEqual(status, 1)
        pid = re.fullmatch(r"Started local simulation server \((\d+)\)\n", output)[1]
        self.assertTrue(errors.endswith(f"Stopped the simulation server ({pid}) again, which this start had started.\n"), errors)
        self.assertFalse(is_running(pid))
        self.assertEqual(self.run_script("status")[0], 3)

    def test_a_start_that_fails_leaves_those_that_ran_before(self):
        os.rename(self.path("config/session/local.json"), self.path("tmp/local.json"))
        self.start()
        self.configure("local", kinds=("session",), logDir="/proc/nowhere")
        status, _, errors = self.run_script("start")
        self.assertEqual(status, 1)
        self.assertNotIn("Stopped", errors)
        self.assertTrue(is_running(self.pid("simulation")))

    def test_a_bad_configuration_is_told_before_anything_is_started(self):
        self.write("config/session/local.json", "{ nonsense")
        status, output, errors = self.run_script("start")
        self.assertEqual((status, output), (1, ""))
        self.assertRegex(errors, r"config/session/local\.json:1:\d+: not JSON: ")
        self.assertFalse(os.path.exists(self.path("log/.simulation.pid")))

    def test_a_server_that_ends_at_once_is_told_with_its_last_words(self):
        self.configure("local", kinds=("session",), logDir="/proc/nowhere")
        status, _, errors = self.run_script("start")
        self.assertEqual(status, 1)
        self.assertRegex(errors, r"^The session server ended at once: .*/proc/nowhere.*[^.]\. It said:\n")  # why comes first
        self.assertIn("output.log", errors)
        self.assertFalse(os.path.exists(self.path("log/.session.pid")))

    def test_a_server_without_the_program_that_starts_simulations_does_not_start(self):
        os.unlink(self.path("build/release/bin"))
        os.makedirs(self.path("build/release/bin"))
        for program in os.listdir(PROGRAMS):
            if program.startswith("webots-") and program != "webots-process-guard":
                shutil.copy(os.path.join(PROGRAMS, program), self.path("build/release/bin"))
        status, _, errors = self.run_script("start")
        self.assertEqual(status, 1)
        self.assertRegex(errors, r"^The simulation server ended at once: There is no program \S+/webots-process-guard, which starts simulations: build it")

    def is_sanitized(self):
        with open(os.path.join(PROGRAMS, "webots-site"), "rb") as program:
            return b"__asan_init" in program.read()

    def test_what_a_shell_allows_too_little_of_is_told_before_anything_is_started(self):
        for limit, sentence in (("-n 20", r"A server needs \d+ open files at least, and may have 20\. Use ulimit -n "),
                                ("-f 0", r"The logs of a server can't be written, because each file may have 0 kB at most\. Use ulimit -f unlimited "),
                                ("-v 100000", r"A server needs \d+ MB of address space at least, and may have 97 MB\. Use ulimit -v unlimited ")):
            if limit.startswith("-v") and self.is_sanitized():
                continue  # sanitizers reserve terabytes
            status, output, errors = self.run_script("start", command=("bash", "-c", f'ulimit {limit}; ./server.sh "$@"', "bash"))
            self.assertEqual((status, output), (1, ""))
            self.assertRegex(errors, f"^{sentence}")

    def test_another_configuration_does_not_replace_servers_that_run(self):
        self.configure("other")
        self.start()
        status, _, errors = self.run_script("start", "other")
        self.assertEqual(status, 1)
        self.assertRegex(errors, r"runs with config/simulation/local\.json")

    def test_wrong_arguments_print_the_usage(self):
        for arguments in ([], ["begin"], ["start", "local", "more"], ["install", "more"], ["package", "local"],
                          ["start", "../local"], ["stop", "--port", "3000"], ["start", "--port"]):
            status, output, errors = self.run_script(*arguments)
            self.assertEqual((status, output), (2, ""))
            lines = errors.splitlines()
            if arguments:
                self.assertEqual(lines.pop(0), "Not understood: ./server.sh " + " ".join(arguments))
            self.assertEqual(lines[0], "Usage: ./server.sh start|restart [NAME|--lan] [--port NUMBER]")
            self.assertEqual(lines[-1], "./server.sh help says what each does.")

    def test_help_fits_a_terminal_and_explains_every_word_of_its_usage(self):
        for word in ("help", "--help", "-h"):
            status, output, errors = self.run_script(word)
            self.assertEqual((status, errors), (0, ""))
        lines = output.splitlines()
        self.assertLessEqual(max(map(len, lines)), 80)
        words = set(re.findall(r"--lan|--port|NAME|\b[a-z]{4,}", "".join(lines[:3]).replace("server.sh", "")))
        self.assertEqual(words - {match[1] for line in lines[3:] if (match := re.match(r"  (\S+) +[A-Z]", line))}, set())


class Status(ServerScriptTest):
    def test_the_servers_that_run_are_described(self):
        self.assertEqual(self.run_script("status"), (3, "No server is running\n", ""))
        self.start()
        status, output, errors = self.run_script("status")
        self.assertEqual((status, errors), (0, ""))
        lines = output.splitlines()
        began = r"runs since \d{4}-\d\d-\d\d \d\d:\d\d:\d\d"
        self.assertRegex(lines[0], rf"^The simulation server {began} \({self.pid('simulation')}\)$")
        self.assertEqual(lines[1:5], ["  configuration  config/simulation/local.json",
                                      f"  address        http://localhost:{self.ports['simulation']}/monitor",
                                      "  logs           log/simulation", "  seats          0 of 100 taken"])
        self.assertRegex(lines[5], rf"^The session server {began} \({self.pid('session')}\)$")
        self.assertEqual(lines[6:], ["  configuration  config/session/local.json", f"  address        http://localhost:{self.ports['session']}/",
                                     "  logs           log/session", "  visitors       A machine is free."])
        self.assertEqual(self.run_script("status", "local")[0], 0)
        self.assertEqual(self.run_script("status", "other"), (3, "No other server is running\n", ""))

    def test_a_server_is_said_to_run_since_it_began(self):
        if not shutil.which("ps"):
            self.skipTest("ps is missing (package procps)")
        self.start()
        said = re.search(r"since (\S+ \S+)", self.run_script("status")[1])[1]
        known = subprocess.run(["ps", "-o", "lstart=", "-p", str(self.pid("simulation"))], capture_output=True, text=True, check=True,
                               env={**os.environ, "LC_ALL": "C"}).stdout.strip()
        difference = datetime.datetime.fromisoformat(said) - datetime.datetime.strptime(known, "%a %b %d %H:%M:%S %Y")
        self.assertLessEqual(abs(difference.total_seconds()), 1, f"{said}, {known}")  # both round

    def test_a_server_that_does_not_answer_is_told(self):
        self.start()
        os.kill(self.pid("simulation"), signal.SIGSTOP)
        self.addCleanup(os.kill, self.pid("simulation"), signal.SIGCONT)
        status, output, _ = self.run_script("status")
        self.assertEqual(status, 0)
        self.assertIn(f"  It does not answer on port {self.ports['simulation']}.\n", output)

    def test_nothing_is_changed(self):
        self.write("log/.session.pid", "no number\n")
        self.assertEqual(self.run_script("status")[0], 3)
        with open(self.path("log/.session.pid")) as file:
            self.assertEqual(file.read(), "no number\n")


class Installing(ServerScriptTest):
    def setUp(self):
        super().setUp()
        for name, text in {"cpack": 'mkdir -p build/release/packages; touch build/release/packages/{webots-cloud-demo_1,libwebots-cloud-dev_1}.deb',
                           "apt-get": 'printf "%s\\n" "$@" >installed', "sudo": 'exec "$@"'}.items():
            self.write(f"bin/{name}", f"#!/bin/bash\n{text}\n")
            os.chmod(self.path(f"bin/{name}"), 0o755)

    def test_the_packages_of_the_servers_are_installed_and_it_is_said_where_things_are(self):
        self.write("build/release/packages/webots-cloud-demo_0.deb", "of an older version")
        status, output, errors = self.run_script("install")
        self.assertEqual((status, errors), (0, ""))
        with open(self.path("installed")) as file:
            arguments = file.read().splitlines()
        self.assertEqual([argument for argument in arguments if argument.endswith(".deb")],
                         [self.path("build/release/packages/webots-cloud-demo_1.deb")])
        self.assertIn("Dpkg::Options::=--force-confold", arguments)
        for said in ("http://localhost:1999/ ", "/etc/webots-cloud/session.json", "/var/lib/webots-cloud/session/log"):
            self.assertIn(said, output)

    def test_packages_are_made_without_being_installed(self):
        self.start()  # nothing of it is disturbed
        status, output, errors = self.run_script("package")
        self.assertEqual((status, errors), (0, ""))
        self.assertEqual(output.splitlines(), [f"build/release/packages/{name}.deb" for name in ("libwebots-cloud-dev_1", "webots-cloud-demo_1")])
        self.assertFalse(os.path.exists(self.path("installed")))

    def test_what_is_packaged_is_hardened(self):
        self.write("bin/cmake", "#!/bin/sh\necho \"$@\" >>called\n")
        asked = "--preset release -DWEBOTS_CLOUD_HARDENING=ON"
        self.write("build/release/build.ninja", "# of a start, without")
        self.write("build/release/CMakeCache.txt", "WEBOTS_CLOUD_HARDENING:BOOL=OFF\n")
        self.assertEqual(self.run_script("package")[0], 0)
        self.assertEqual(self.read("called").splitlines()[0], asked)
        self.write("build/release/CMakeCache.txt", "WEBOTS_CLOUD_HARDENING:BOOL=ON\n")
        self.write("called", "")
        self.assertEqual(self.run_script("package")[0], 0)
        self.assertNotIn("--preset release -D", self.read("called"))  # it is already
        self.write("called", "")
        self.start()
        self.assertNotIn("HARDENING", self.read("called"))  # and stays as it is

    def test_servers_that_run_here_would_be_in_the_way(self):
        self.start()
        status, _, errors = self.run_script("install")
        self.assertEqual((status, errors), (1, "The session server of this folder runs, and has the ports: ./server.sh stop\n"))
        self.assertFalse(os.path.exists(self.path("installed")))

    def test_packages_that_can_not_be_made_are_not_installed(self):
        self.write("bin/cpack", "#!/bin/sh\necho CPack Error: no disk\nexit 1\n")
        status, _, errors = self.run_script("install")
        self.assertEqual((status, errors), (1, "CPack Error: no disk\nThe packages can't be made: see build/release/packages.log\n"))
        self.assertFalse(os.path.exists(self.path("installed")))


class Stopping(ServerScriptTest):
    def test_a_stop_returns_when_both_have_ended(self):
        self.start()
        pids = {kind: self.pid(kind) for kind in ("session", "simulation")}
        status, output, errors = self.run_script("stop")
        self.assertEqual((status, errors), (0, ""))
        self.assertEqual(output, "".join(f"Stopped {kind} server ({pid})\n" for kind, pid in pids.items()))
        self.assertEqual([is_running(pid) for pid in pids.values()], [False, False])
        self.assertEqual(self.run_script("stop"), (0, "No server is running\n", ""))

    def test_a_name_stops_only_the_servers_that_run_with_it(self):
        self.configure("other", kinds=["session"])
        self.start()
        self.assertEqual(self.run_script("stop", "other")[:2], (0, "No other server is running\n"))
        self.assertTrue(is_running(self.pid("session")))

    def test_a_number_that_another_program_has_now_is_never_killed(self):
        stranger = subprocess.Popen(["sleep", "600"])
        self.addCleanup(stranger.wait)
        self.addCleanup(stranger.kill)
        self.write("log/.session.pid", f"{stranger.pid}\n")
        self.assertEqual(self.run_script("stop"), (0, "No server is running\n", ""))
        self.assertIsNone(stranger.poll())
        self.write("log/.session.pid", f"{stranger.pid}\n")
        self.assertIn("Started local session server", self.start())
        self.assertIsNone(stranger.poll())

    def test_a_program_that_calls_itself_a_server_is_none(self):
        """As a simulation may, which nobody's stop would end."""
        called = os.path.join(os.path.realpath(self.folder), "build/release/bin/webots-session-server")
        stranger = subprocess.Popen([called, "-f", "config/session/local.json"], executable="/usr/bin/tail", cwd=self.folder, stdout=subprocess.DEVNULL)
        self.addCleanup(stranger.wait)
        self.addCleanup(stranger.kill)
        self.assertEqual(self.run_script("status"), (3, "No server is running\n", ""))
        self.assertIn("Started local session server", self.start())
        self.assertEqual(self.run_script("stop")[0], 0)
        self.assertIsNone(stranger.poll())

    def test_servers_are_known_without_the_folder_of_logs(self):
        self.start()
        pids = {kind: self.pid(kind) for kind in ("session", "simulation")}
        shutil.rmtree(self.path("log"))
        status, output, errors = self.run_script("status")
        self.assertEqual((status, errors), (0, ""))
        for kind, pid in pids.items():
            self.assertRegex(output, rf"The {kind} server runs since .* \({pid}\)\n")
            self.assertIn(f"The local {kind} server is already running ({pid})\n", self.start())
        shutil.rmtree(self.path("log"))
        status, output, errors = self.run_script("stop")
        self.assertEqual((status, output, errors), (0, "".join(f"Stopped {kind} server ({pid})\n" for kind, pid in pids.items()), ""))
        self.assertEqual([is_running(pid) for pid in pids.values()], [False, False])

    def test_servers_are_known_after_their_folder_was_renamed(self):
        self.start()
        name, renamed = self.folder, self.folder + "_renamed"
        os.rename(name, renamed)
        self.folder = renamed
        try:
            self.assertIn("session server runs since", self.run_script("status")[1])
            self.assertIn("is already running", self.run_script("start")[1])
            self.assertEqual(self.run_script("stop")[1].count("Stopped "), 2)
        finally:
            self.folder = name
            os.rename(renamed, name)

    def test_stale_and_broken_pid_files_count_as_none(self):
        for content in ("", "nonsense", "-1", "4194304000"):
            self.write("log/.simulation.pid", content)
            self.assertEqual(self.run_script("stop"), (0, "No server is running\n", ""), content)

    def test_a_restart_gives_new_processes_of_the_named_configuration(self):
        self.configure("other")
        self.start()
        before = self.pid("session")
        status, output, _ = self.run_script("restart", "other")
        self.assertEqual(status, 0, output)
        self.assertRegex(output, rf"Stopped session server \({before}\)(.|\n)*Started other session server")
        self.assertNotEqual(self.pid("session"), before)

    def test_a_restart_that_can_not_succeed_stops_nothing(self):
        self.start()
        self.write("config/simulation/broken.json", "[]")
        self.assertEqual(self.run_script("restart", "broken")[0], 1)
        self.configure("uncertified", sslCertificate="/nope.pem", sslKey="/nope.pem")
        status, output, errors = self.run_script("restart", "uncertified")
        self.assertEqual((status, output), (1, ""))
        self.assertIn("the certificate /nope.pem can't be used: No such file or directory", errors)
        self.assertTrue(is_running(self.pid("session")) and is_running(self.pid("simulation")))


class Places(ServerScriptTest):
    def test_sh_and_a_link_start_it_as_well(self):
        link = self.path("tmp/link")
        os.symlink(self.path("server.sh"), link)
        for command in (["sh", self.path("server.sh")], [link]):
            status, output, errors = self.run_script("status", command=command)
            self.assertEqual((status, errors), (3, ""), output)

    def test_a_checkout_keeps_its_line_ends(self):
        checkout = os.path.dirname(SCRIPT)
        if not os.path.exists(os.path.join(checkout, ".git")) or not shutil.which("git"):
            self.skipTest("this is no checkout of git")
        copy = self.path("copy")
        made = subprocess.run(["git", "clone", "-q", "-c", "core.autocrlf=true", checkout, copy], capture_output=True, text=True)
        if made.returncode != 0:
            self.skipTest(f"git can't clone the checkout: {made.stderr}")
        with open(os.path.join(copy, "server.sh"), "rb") as file:
            self.assertNotIn(b"\r", file.read())

    @unittest.skipIf(os.geteuid() != 0, "only root can run it as somebody else, and mount a disk")
    def test_a_folder_of_another_user_is_told_with_the_remedy(self):
        os.makedirs(self.path("log"))
        os.chmod(self.folder, 0o755)
        status, _, errors = self.run_script("start", user="nobody")
        self.assertEqual(status, 1)
        self.assertIn("The folder log belongs to root, who has started servers here.", errors)
        self.assertIn("sudo chown -R nobody: log", errors)

    def test_a_full_disk_leaves_no_empty_password(self):
        os.makedirs(self.path("log"))
        mount_small_disk(self, self.path("log"), "64k")
        self.configure("local", ("session",), teacherPasswordFile="log/.teacher-password")
        with open(self.path("log/filler"), "wb") as file, self.assertRaises(OSError):
            while True:
                os.write(file.fileno(), bytes(4096))
        status, _, errors = self.run_script("start")
        self.assertEqual(status, 1)
        self.assertIn("can't be written to log/.teacher-password: is the disk full?", errors)
        self.assertFalse(os.path.exists(self.path("log/.teacher-password")))
        os.remove(self.path("log/filler"))
        self.write("log/.teacher-password", "")  # as an older version has left it
        self.start()
        with open(self.path("log/.teacher-password")) as file:
            self.assertRegex(file.read(), r"^[a-z]{4}-[a-z]{4}-[a-z]{4}\n$")


def main():
    global SCRIPT, PROGRAMS
    SCRIPT, PROGRAMS = (os.path.abspath(argument) for argument in sys.argv[1:3])
    missing = [name for name in ("bash", "flock") if not shutil.which(name)]
    if missing:
        print(f"skipped: {', '.join(missing)} not installed")
        return 77
    return 0 if unittest.main(argv=sys.argv[:1] + sys.argv[3:], verbosity=2, exit=False).result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
