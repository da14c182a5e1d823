#!/usr/bin/python3
"""`--doctor` of both servers, where nothing is wrong, where it asks others, and beside servers that run. What is broken has a row in
broken_configurations_test.py.

The twin: the Python servers have nothing like it.
"""

import contextlib
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
from support.certificates import Authority  # noqa: E402
from support.examination import Examination, by_subject  # noqa: E402
from support.mailbox import CompletionQueue  # noqa: E402
from support.servers import PATIENCE, SessionServer, SimulationServer, main, program, wait_until  # noqa: E402

NOBODY = ["http://localhost:1"]  # instead of a forge of the internet


class SessionDoctor(Examination):
    def test_a_healthy_server_has_only_good_lines(self):
        found = self.findings()
        self.assertEqual({each["verdict"] for each in found.values()}, {"ok"}, found)
        self.assertEqual(set(found), {"configuration", f"port {self.port}", "logs", f"machine {self.machine}", "name server", "public address"})

    def test_people_get_a_line_for_each_and_a_number_at_the_end(self):
        status, output = self.examine(port=self.port)
        lines = output.splitlines()
        self.assertTrue(lines[0].startswith("ok       configuration"), output)
        self.assertRegex(lines[-1], r"(found nothing wrong|in \d+ checks)\.$")
        self.assertNotIn("\x1b", output)
        self.assertIn(status, (0, 1))

    def test_json_is_for_the_doctor_alone(self):
        refused = subprocess.run([self.program, "--json"], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual((refused.returncode, refused.stderr), (2, "webots-session-server: --json is for --doctor and --decisions.\n"))

    def test_a_configuration_that_can_not_be_read_is_all_that_is_found(self):
        status, output = self.examine(text='{"port": "x"}')
        self.assertEqual(status, 2)
        self.assertTrue(output.startswith("fault    configuration  "), output)
        self.assertIn("the server does not start with it", output)

    def test_a_good_certificate(self):
        authority = Authority(self.folder, "an authority")
        certificate, key = authority.issue("own", "DNS:localhost", days=60)
        self.environment = {"SSL_CERT_FILE": authority.certificate}
        found = self.findings(ssl=True, simulationServers=self.inside, sslCertificate=certificate, sslKey=key)
        self.assertEqual(found["certificate"]["found"], "for localhost, valid for 59 days", found)

    def test_a_mail_server_is_tried_without_a_mail(self):
        with CompletionQueue() as mailbox:
            mail = {"administrator": "a@example.org", "mailSender": "s@example.org", "mailServer": "localhost", "mailServerPort": mailbox.port}
            self.assertEqual(self.findings(**mail)["mail"]["verdict"], "ok")
            self.assertEqual(mailbox.mails, [])

    def test_servers_that_take_a_connection_and_say_nothing_hold_up_no_other_check(self):
        with contextlib.ExitStack() as open_sockets:
            silent = [open_sockets.enter_context(closing(socket.create_server(("127.0.0.1", 0)))).getsockname()[1] for _ in range(2)]
            found = self.findings(simulationServers=[f"localhost:{silent[0]}", self.machine], administrator="a@example.org",
                                  mailSender="s@example.org", mailServer="localhost", mailServerPort=silent[1])
        self.assertEqual({name: each["verdict"] for name, each in found.items() if each["verdict"] != "ok"},
                         {f"machine localhost:{silent[0]}": "fault", "mail": "fault"}, found)

    def test_a_server_and_a_program_that_hang_are_told_and_hold_up_no_other_check(self):
        path = os.path.join(self.folder, "operator.sock")
        self.put_on_path("nft", "sleep 60")
        with closing(socket.socket(socket.AF_UNIX)) as silent:
            silent.bind(path)
            silent.listen()
            status, output = self.examine("--json", operatorSocket=path)
        found = by_subject(output)
        self.assertEqual((status, found["public address"]["verdict"]), (2, "fault"))
        self.assertIn("the server hangs", found["public address"]["found"])
        self.assertEqual(found[f"port {self.port}"]["found"], "the server runs there")
        self.assertNotIn("nothing was found out", found["firewall"]["found"])

    def test_a_firewall_is_seen(self):
        self.put_on_path("nft", "echo 'type filter hook input priority filter; policy drop;'")
        self.put_on_path("iptables", "echo 'not root' >&2; exit 4")
        firewall = by_subject(self.examine("--json")[1])["firewall"]
        self.assertEqual(firewall["verdict"], "warning", firewall)
        self.assertIn("it drops what comes in unless a rule accepts it", firewall["found"])


@unittest.skipUnless(os.geteuid() == 0, "only root is shown what a service sees")
class DoctorOfAService(Examination):
    """Root asks about the configuration of a service. What systemd does is played; tests/systemd_packages.py asks the real one."""

    def keys(self):
        return {**super().keys(), "simulationServers": ["localhost:1"]}

    def setUp(self):
        super().setUp()
        self.name = os.path.join(self.folder, "c.json")
        unit = os.path.join(self.folder, "unit")
        with open(unit, "w") as file:
            file.write(f"[Service]\nType=notify\nExecStart=/usr/bin/webots-session-server {self.name}\n"
                       "RuntimeDirectory=webots\nUser=nobody\nProtectSystem=strict\n")
        self.put_on_path("systemctl", f'[ "$*" = "cat --no-pager webots-session-server.service" ] && cat {unit}')
        self.words = os.path.join(self.folder, "words")
        self.run_in_service('exec setpriv --reuid=65534 --regid=65534 --clear-groups "$@"')

    def run_in_service(self, what):
        self.put_on_path("systemd-run", f"""printf '%s\\n' "$@" >{self.words}
            while [ "${{1#--}}" != "$1" ]; do case $1 in --setenv=*) export "${{1#--setenv=}}";; esac; shift; done
            {what}""")

    def test_it_looks_as_the_user_of_the_service(self):
        status, output = self.examine("--json")
        found = by_subject(output)
        self.assertEqual(status, 2)
        self.assertEqual(found["service"]["verdict"], "ok")
        self.assertIn("Permission denied", found["configuration"]["found"])  # the folder is root's alone
        with open(self.words) as words:
            self.assertEqual([word for word in words.read().splitlines() if word.startswith("--property")],
                             ["--property=User=nobody", "--property=ProtectSystem=strict"])

    def test_it_has_users_made_for_simulations_as_the_service_has(self):
        with open(os.path.join(self.folder, "unit"), "a") as file:
            file.write("ExecStartPre=-+/usr/bin/webots-process-guard --pin-users %t/webots\n")
        self.examine("--json")
        guard = os.path.join(os.path.dirname(self.program), "webots-process-guard")
        with open(self.words) as words:
            self.assertEqual([word for word in words.read().splitlines() if word.startswith("--property")][2:],
                             ["--property=RuntimeDirectory=webots-cloud/doctor", "--property=RuntimeDirectoryMode=0700",
                              f"--property=ExecStartPre=-+{guard} --pin-users /run/webots-cloud/doctor",
                              f"--property=ExecStopPost=-+{guard} --unpin-users /run/webots-cloud/doctor"])

    def test_what_root_alone_sees_comes_from_root(self):
        os.chmod(self.folder, 0o755)
        self.put_on_path("nft", "echo 'chain input { type filter hook input priority 0; policy drop; }'")
        found = by_subject(self.examine("--json")[1])
        self.assertEqual(found["configuration"]["verdict"], "ok")
        self.assertIn("none names port", found["firewall"]["found"])  # the user of the service may not list the rules
        self.assertIn("nothing can be written to", found["logs"]["found"])
        self.assertLessEqual({"clock", "memory"}, set(found))

    def test_the_server_that_runs_tells_root_who_it_is(self):
        os.chmod(self.folder, 0o755)
        path = os.path.join(self.folder, "operator.sock")  # root's alone
        with SessionServer([], operatorSocket=path) as running:
            found = by_subject(self.examine("--json", port=running.port, operatorSocket=path)[1])
        self.assertEqual(found["public address"]["found"], f"{running.url}/livez leads here")

    def test_a_service_that_systemd_can_not_start_is_a_fault_and_root_looks_by_itself(self):
        self.run_in_service("echo 'Unknown assignment: Foo=1' >&2; exit 1")
        found = by_subject(self.examine("--json")[1])
        self.assertEqual(found["service"]["verdict"], "fault")
        self.assertIn("Unknown assignment: Foo=1", found["service"]["found"])
        self.assertEqual(found["configuration"]["verdict"], "ok")

    def test_another_configuration_is_looked_at_as_who_asks(self):
        self.put_on_path("systemctl", "echo '[Service]'; echo 'ExecStart=/usr/bin/webots-session-server /etc/other.json'")
        found = by_subject(self.examine("--json")[1])
        self.assertNotIn("service", found)
        self.assertFalse(os.path.exists(self.words))


class SimulationDoctor(Examination):
    SERVER = "simulation"

    def test_a_healthy_server_has_only_good_lines(self):
        found = self.findings()
        self.assertEqual(set(found), {"configuration", f"port {self.port}", f"ports from {self.port + 1}", "simulator", "state", "cache", "logs",
                                      "start", "forge", "name server", "public address"})
        self.assertEqual({each["verdict"] for each in found.values() if each["subject"] != "simulator"}, {"ok"}, found)

    def test_the_walls_of_simulations_are_tried(self):
        sandbox = by_subject(self.examine("--json")[1])["sandbox"]
        self.assertEqual(sandbox["verdict"], "warning")
        self.assertIn("Simulations run without a sandbox", sandbox["found"])
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith("webots-doctor")], [])

    def test_an_empty_world_is_loaded_by_the_simulator(self):
        found = by_subject(self.examine("--json", sandbox="auto")[1])
        self.assertEqual(found["start"]["verdict"], "ok", found)
        self.assertRegex(found["start"]["found"], r"^the simulator has loaded an empty world within \d+ s$")

    def test_what_a_simulator_printed_that_does_not_start_is_told(self):
        webots = os.path.join(self.folder, "webots")
        with open(webots, "w") as file:
            file.write("#!/bin/sh\necho libGL.so.1: cannot open shared object file >&2\nexit 127\n")
        os.chmod(webots, 0o755)
        found = by_subject(self.examine("--json", webotsHome=self.folder)[1])["start"]
        self.assertEqual(found["verdict"], "fault", found)
        self.assertRegex(found["found"], r"^the simulator does not load an empty world: .*; it printed: libGL.so.1: cannot open shared object file$")
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith("webots-doctor")], [])

    def test_what_draws_on_the_screen_of_all_simulations(self):
        self.put_on_path("glxinfo", 'echo "$*" > "$HOME/asked"; echo "OpenGL renderer string: llvmpipe (LLVM 15.0.6, 256 bits)"')
        renderer = by_subject(self.examine("--json", display=":77")[1])["renderer"]
        self.assertEqual((renderer["verdict"], renderer["found"]),
                         ("warning", "the processor draws, not a graphics processor: llvmpipe (LLVM 15.0.6, 256 bits)"))
        with open(os.path.join(self.folder, "asked")) as file:
            self.assertEqual(file.read(), "-display :77 -B\n")
        self.assertNotIn("renderer", by_subject(self.examine("--json", display="none")[1]))

    def test_webots_with_its_release(self):
        home = os.path.join(self.folder, "webots_home")
        os.makedirs(os.path.join(home, "resources"))
        shutil.copy(program("webots-demo-simulator"), os.path.join(home, "webots"))
        with open(os.path.join(home, "resources", "version.txt"), "w") as file:
            file.write("R2025a\n")
        simulator = self.findings(webotsHome=home)["simulator"]
        self.assertEqual((simulator["verdict"], simulator["found"]), ("ok", f"Webots R2025a, {home}/webots"))


class RunningServers(unittest.TestCase):
    """The doctor asks the server that runs with the same configuration; and that has a doctor of its own."""

    def doctor(self, running, **keys):
        running.configure(**keys)
        status, output = running.command("--doctor", "--json")
        self.assertIn(status, (0, 1, 2))
        return by_subject(output)

    def test_the_public_address_leads_to_the_very_server(self):
        with SimulationServer(forges=NOBODY) as simulation, SimulationServer() as other, SessionServer([simulation.address]) as session:
            for running in (simulation, session):
                found = self.doctor(running)
                self.assertEqual(found[f"port {running.port}"]["found"], "the server runs there")
                self.assertEqual(found["public address"]["found"], f"{running.url}/livez leads here")
            # As if the name, or the proxy in front, led elsewhere.
            elsewhere = self.doctor(simulation, server=f"localhost:{other.port}", portRewrite=True)["public address"]
            self.assertEqual(elsewhere["verdict"], "fault")
            self.assertIn("does not lead to this server: HTTP status 404", elsewhere["found"])

    def test_a_log_that_was_moved_away_while_the_server_runs(self):
        with SimulationServer(forges=NOBODY, debug=False, logDir="site") as simulation, \
                SessionServer([simulation.address], debug=False, logDir="site") as session:
            for running in (simulation, session):
                self.assertNotIn("log file", self.doctor(running))
                site, away = (os.path.join(running.folder, name) for name in ("site", "away"))
                os.rename(site, away)
                shutil.copytree(away, site)
                wait_until(lambda: "log file" in self.doctor(running), "the server has looked a moment ago", patience=2 * PATIENCE)
                found = self.doctor(running)["log file"]
                self.assertEqual(found["verdict"], "fault")
                kind = running.PROGRAM.split("-")[1]
                self.assertIn(f"not at {site}/{kind}/output.log any more", found["found"])
                self.assertIn("Restart the server", found["remedy"])

    def test_the_operator_asks_a_running_server_and_others_can_not(self):
        folder = tempfile.mkdtemp(prefix="webots_cloud_doctor_")
        self.addCleanup(shutil.rmtree, folder)
        token = os.path.join(folder, "token")
        with open(token, "w") as file:
            file.write("a-token-of-the-operator\n")
        os.chmod(token, 0o600)
        authorized = {"Authorization": "Bearer a-token-of-the-operator"}
        with SimulationServer(operatorTokenFile=token, sandbox="none", forges=NOBODY) as simulation, \
                SessionServer([simulation.address], operatorTokenFile=token) as session:
            for running in (simulation, session):
                self.assertEqual(running.ask("/api/doctor")[0], 404)
                self.assertEqual(running.ask("/api/doctor", "POST", authorized)[0], 405)
                self.assertIsNone(json.loads(running.ask("/api/doctor?last", headers=authorized)[1])["examined"])
                wait_until(lambda: json.loads(running.ask("/api/doctor", headers=authorized)[1])["examined"], "nobody has looked")
                found = by_subject(running.ask("/api/doctor?last", headers=authorized)[1])
                self.assertEqual(found["public address"]["found"], f"{running.url}/livez leads here")
                # What the server has chosen at its start is known, too.
                if running is simulation:
                    self.assertEqual(found["sandbox"]["verdict"], "warning", found)
            self.assertEqual(found[f"machine {simulation.address}"]["verdict"], "ok")
            # After SIGHUP it judges the configuration that was read again.
            simulation.reread(forges=["http://127.0.0.1:9"])
            wait_until(lambda: "The configuration was read again" in simulation.log(), simulation.log)
            wait_until(lambda: "127.0.0.1:9" in simulation.ask("/api/doctor", headers=authorized)[1], lambda: simulation.ask("/api/doctor?last", headers=authorized)[1])


if __name__ == "__main__":
    main()
