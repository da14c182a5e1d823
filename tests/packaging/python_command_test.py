#!/usr/bin/python3
"""`python session_server.py` and `python simulation_server.py`, as the documents of the Python servers say, in a folder like a clone of this one.

Usage: python_command_test.py FOLDER_OF_PROGRAMS
"""

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
import urllib.request

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(SOURCE, "tests"))
from support.ports import free_port  # noqa: E402
from support.servers import wait_until  # noqa: E402

SCRIPTS = ("session_server.py", "simulation_server.py", os.path.join("apps", "python_command.py"))


def answer(port, path, headers=None):
    try:
        with urllib.request.urlopen(urllib.request.Request(f"http://localhost:{port}{path}", headers=headers or {}), timeout=10) as response:
            return response.read().decode()
    except OSError:
        return None


class PythonCommands(unittest.TestCase):
    def setUp(self):
        self.folder = self.enterContext(tempfile.TemporaryDirectory(prefix="webots_cloud_python_command_"))
        for name in SCRIPTS:
            os.makedirs(os.path.dirname(os.path.join(self.folder, name)), exist_ok=True)
            shutil.copy(os.path.join(SOURCE, name), os.path.join(self.folder, name))
        shutil.copytree(os.path.join(SOURCE, "examples", "demo_projects"), os.path.join(self.folder, "examples", "demo_projects"))
        self.ports = {"session": free_port(), "simulation": free_port(following=20)}
        for kind in self.ports:
            os.makedirs(os.path.join(self.folder, "config", kind))
            # As it ships, but for the ports.
            with open(os.path.join(SOURCE, "config", kind, "default.json")) as file:
                config = json.load(file)
            others = {"session": {"simulationServers": [f"localhost:{self.ports['simulation']}"], "loadThreshold": 1000},  # other tests run beside
                      "simulation": {"maxConnections": 10}}
            config.update(port=self.ports[kind], **others[kind])
            self.write(os.path.join("config", kind, "default.json"), config)

    def write(self, path, config):
        with open(os.path.join(self.folder, path), "w") as file:
            json.dump(config, file)

    def build(self):
        os.makedirs(os.path.join(self.folder, "build", "release"))
        os.symlink(PROGRAMS, os.path.join(self.folder, "build", "release", "bin"))

    def type(self, *command, cwd=None):
        """A command of the documents; its process, which is ended with the test."""
        process = subprocess.Popen(["/usr/bin/python3", "-B", *command], cwd=cwd or self.folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                   env={**os.environ, "XDG_STATE_HOME": os.path.join(self.folder, "state")}, text=True)

        def end():
            process.kill()
            process.communicate()
        self.addCleanup(end)
        return process

    def ended(self, process, how):
        process.send_signal(how)
        process.communicate(timeout=60)
        return process.returncode

    def test_both_are_started_by_the_commands_of_the_documents(self):
        self.build()
        simulation, session = self.type("simulation_server.py"), self.type("session_server.py")
        wait_until(lambda: answer(self.ports["session"], "/session") == f"ws://localhost:{self.ports['session']}",
                   lambda: "the session server does not send anybody anywhere")
        wait_until(lambda: answer(self.ports["session"], "/") == "1", lambda: "it has heard of no machine")
        self.assertEqual(answer(self.ports["session"], "/request"), "1")
        self.assertIn(f"localhost:{self.ports['simulation']}", answer(self.ports["session"], "/monitor"))
        self.assertEqual(self.ended(session, signal.SIGTERM), 0)
        self.assertEqual(self.ended(simulation, signal.SIGINT), 0)

    def test_a_configuration_is_named_from_anywhere_as_in_an_autostart_entry(self):
        self.build()
        config = os.path.join(self.folder, "config", "session", "default.json")
        os.rename(config, os.path.join(self.folder, "config", "session", "session.json"))
        session = self.type(os.path.join(self.folder, "session_server.py"), os.path.join(self.folder, "config", "session", "session.json"), cwd="/")
        wait_until(lambda: answer(self.ports["session"], "/livez"), lambda: "it does not answer")
        self.assertEqual(self.ended(session, signal.SIGTERM), 0)
        session = self.type(os.path.join("..", "session_server.py"), os.path.join("session", "session.json"), cwd=os.path.join(self.folder, "config"))
        wait_until(lambda: answer(self.ports["session"], "/livez"), lambda: "it does not answer")

    def test_what_is_not_built_is_said_with_what_to_do(self):
        process = subprocess.run(["/usr/bin/python3", "-B", "session_server.py"], cwd=self.folder, text=True, capture_output=True,
                                 env={**os.environ, "PATH": "/nowhere"})
        self.assertEqual(process.returncode, 1)
        self.assertIn("Run ./server.sh start once, which builds it", process.stderr)

    def test_webots_own_page_opened_from_disk_is_told_which_line_to_add(self):
        self.build()
        self.type("session_server.py")
        wait_until(lambda: answer(self.ports["session"], "/livez"), lambda: "it does not answer")
        asked = "/session?url=https://github.com/cyberbotics/webots-cloud-simulation-examples/blob/main/6_binary/worlds/ned.wbt"
        self.assertRegex(answer(self.ports["session"], asked, {"Origin": "null"}), '^Error: .*add "null" to "allowedOrigins"')


if __name__ == "__main__":
    PROGRAMS = os.path.abspath(sys.argv.pop(1))
    unittest.main(verbosity=2)
