#!/usr/bin/python3
"""Contents and names of configuration files can't inject escape sequences into the terminal of whoever checks them."""

import json
import os
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(__file__), ".."))
from support.servers import main, program  # noqa: E402

EVIL = "\x1b]0;title\x07\x1b[2J\u009b31m"


class Terminal(unittest.TestCase):
    def say(self, server, config, *arguments, name="c.json"):
        """The whole output of a program, and its exit status."""
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, name), "w") as file:
                file.write(config if isinstance(config, str) else json.dumps(config))
            finished = subprocess.run([program(f"webots-{server}-server"), *arguments, name], capture_output=True, timeout=30,
                                      cwd=folder, env={**os.environ, "TMPDIR": folder, "HOME": folder})
        said = finished.stdout + finished.stderr
        text = said.decode()
        self.assertTrue(text)
        raw = [character for character in text if (ord(character) < 32 and character != "\n") or 127 <= ord(character) < 160]
        self.assertEqual(raw, [], text)
        return text, finished.returncode

    def check(self, config, *sentences, server="simulation", status=2, **more):
        text, found = self.say(server, config, "--check-config", **more)
        self.assertEqual(found, status, text)
        for sentence in sentences:
            self.assertIn(sentence, text)

    def test_values_of_the_configuration(self):
        self.check({"server": EVIL}, 'key "server": expected')
        self.check({"forges": [{"url": "local:", "directory": EVIL}]}, "without control characters")
        self.check({"forges": [{"url": EVIL, "directory": "nowhere"}]}, "without control characters")
        self.check({"docker": True, "dockerDir": EVIL}, 'key "dockerDir": expected a path without control characters')
        self.check({"sslCertificate": EVIL, "sslKey": EVIL}, 'key "sslCertificate": expected a path without control characters')
        self.check({"blockedRepositories": [EVIL]}, 'key "blockedRepositories": expected')
        self.check({"server": "h", EVIL: 1}, "unknown key", status=0)
        self.check("{" + EVIL, "not JSON")
        self.check({"port": 1, "simulationServers": [EVIL]}, "entry 1: expected", server="session")
        self.check({"port": 1, "simulationServers": [], "mailSenderUser": "a\r\nQUIT"}, 'key "mailSenderUser"', server="session")
        self.check({"port": 1, "simulationServers": [], "mailSenderPassword": "secret\r\n"},
                   'key "mailSenderPassword": expected a string without control characters, found something else\n', server="session")

    def test_what_the_server_could_not_open_is_warned_of(self):
        self.check({"server": "h", "listenAddress": "203.0.113.7"}, 'port 2000: 203.0.113.7 is none of this machine', status=0)
        self.check({"server": "h", "sessionSecret": "/nowhere"}, "/nowhere")
        self.check({"server": "h", "sslCertificate": "/c", "sslKey": "/k", "redirectPort": 80, "challengeFolder": "/nowhere"},
                   'warning: c.json: key "challengeFolder": there is no folder /nowhere')
        self.check({"port": 1, "simulationServers": [], "sessionSecret": "/nowhere"}, "/nowhere", server="session")

    def test_values_of_the_environment(self):
        os.environ["EVIL_FOLDER"] = EVIL
        self.addCleanup(os.environ.pop, "EVIL_FOLDER")
        self.check({"sslCertificate": "$EVIL_FOLDER/c", "sslKey": "k"}, "\\x1b]0;title\\x07\\x1b[2J\\xc2\\x9b31m/c can't be used")
        self.check({"docker": True, "dockerDir": "$EVIL_FOLDER"}, "no simulation can start, since there is no docker-compose")
        self.check({"forges": [{"url": "local:", "directory": "$EVIL_FOLDER"}], "server": "h"}, "there is no folder", status=0)

    def test_names_of_files_and_arguments(self):
        for config, status in (({"server": "h"}, 0), ({"server": 5}, 2), ("{", 2)):
            self.check(config, "\\x1b]0;title", status=status, name=f"{EVIL}.json")
        for arguments in (["--log-format", EVIL], [f"--{EVIL}"]):
            text, status = self.say("session", {}, *arguments)
            self.assertEqual(status, 2)
            self.assertIn("\\x1b]0;title", text)

    def test_a_log_that_cannot_be_opened(self):
        text, status = self.say("session", {"port": 1, "simulationServers": ["a/1"], "logDir": "/proc/nowhere"})
        self.assertEqual((status, text.count("\n")), (2, 1), text)


if __name__ == "__main__":
    main()
