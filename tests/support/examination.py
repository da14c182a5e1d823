"""A configuration in a folder of its own: what `--check-config` and `--doctor` say of it, and whether a server starts with it."""

import json
import os
import shutil
import socket
import subprocess
import tempfile
import unittest

from .ports import free_port
from .servers import PATIENCE, end, program, without_systemd
from .waiting import wait_until
from .web_site import web_site

# What a machine of tests is like is not ours to say.
OF_THE_MACHINE = {"clock", "memory", "firewall", "graphics", "open files", "processes", "user", "sandbox", "display", "renderer"}


def by_subject(answer):
    """The findings of a doctor, from what it prints with `--json`."""
    return {each["subject"]: each for each in json.loads(answer)["findings"]}


class Examination(unittest.TestCase):
    """One server that does not run. Its simulation server (`machine`), or its forge (`forge`), answers."""

    SERVER = "session"

    environment = {}  # variables that differ from ours
    wrapper = ()  # a command line that the program's is put behind
    name = "c.json"  # of the configuration

    @classmethod
    def setUpClass(cls):
        port = cls.enterClassContext(web_site("12.5"))
        cls.machine = f"localhost:{port}"
        cls.inside = [{"address": f"localhost/{port}", "internal": f"127.0.0.1:{port}"}]  # asked by http, whatever "ssl" says
        cls.forge = f"http://localhost:{port}"

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_examination_")
        self.addCleanup(shutil.rmtree, self.folder)
        self.port = free_port(following=3)

    @property
    def program(self):
        return program(f"webots-{self.SERVER}-server")

    def keys(self):
        """Those of a configuration that nothing is wrong with."""
        own = {"session": {"simulationServers": [self.machine]},
               "simulation": {"forges": [self.forge], "notify": [], "maxConnections": 3, "sandbox": "none", "simulationUser": "none", "display": "none"}}
        return {"server": "localhost", "ssl": False, "portRewrite": False, "port": self.port, "logDir": "log", **own[self.SERVER]}

    def command(self, *options, text=None, **keys):
        """Command line, environment and folder in which the program runs with these keys besides its own, or with another text."""
        with open(os.path.join(self.folder, self.name), "w") as file:
            file.write(text or json.dumps({**self.keys(), **keys}))
        environment = {**without_systemd(os.environ), "HOME": self.folder, "TMPDIR": self.folder, "XDG_RUNTIME_DIR": "",
                       "XDG_STATE_HOME": os.path.join(self.folder, "state"), "XDG_CACHE_HOME": os.path.join(self.folder, "cache"),
                       "RES_OPTIONS": "timeout:1 attempts:1", **self.environment}
        return {"args": [*self.wrapper, self.program, *options, self.name], "env": environment, "cwd": self.folder}

    def ask(self, *options, **keys):
        """Exit status, standard output and standard error. Whatever stands in the configuration, it can't steer the terminal of who asks."""
        done = subprocess.run(**self.command(*options, **keys), capture_output=True, timeout=PATIENCE)
        texts = [each.decode() for each in (done.stdout, done.stderr)]
        for text in texts:
            raw = [character for character in text if (ord(character) < 32 and character != "\n") or 127 <= ord(character) < 160]
            self.assertEqual(raw, [], text)
        return (done.returncode, *texts)

    def check(self, **keys):
        """Exit status of `--check-config`, and its complaints."""
        status, _, said = self.ask("--check-config", **keys)
        return status, said

    def examine(self, *options, **keys):
        """Exit status of `--doctor`, and what it prints."""
        status, output, said = self.ask("--doctor", *options, **keys)
        self.assertEqual(said, "")
        return status, output

    def findings(self, **keys):
        """Of the doctor, by their subjects, but for those that depend on the machine."""
        status, output = self.examine("--json", **keys)
        self.assertEqual(status, ("ok", "warning", "fault").index(json.loads(output)["verdict"]))
        return {subject: each for subject, each in by_subject(output).items() if subject not in OF_THE_MACHINE}

    def starts(self, **keys):
        """Whether a server says that it is ready, as systemd hears it; and the log until then."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as ready, open(os.path.join(self.folder, "started"), "w+") as log:
            ready.bind(os.path.join(self.folder, "notify"))
            ready.setblocking(False)
            command = self.command(**keys)
            command["env"]["NOTIFY_SOCKET"] = ready.getsockname()
            process = subprocess.Popen(**command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
            self.addCleanup(end, process)
            heard = []

            def has_decided():
                try:
                    heard.append(ready.recv(4096))
                except BlockingIOError:
                    return process.poll() is not None
                return any(b"READY=1" in each for each in heard)

            try:
                wait_until(has_decided, "the server neither starts nor ends")
                is_ready = process.poll() is None
            finally:
                end(process)
                os.remove(ready.getsockname())
            log.seek(0)
            return is_ready, log.read()

    def put_on_path(self, name, script):
        """A program of this name comes before any other."""
        folder = os.path.join(self.folder, "programs")
        os.makedirs(folder, exist_ok=True)
        with open(os.path.join(folder, name), "w") as file:
            file.write(f"#!/bin/sh\n{script}\n")
        os.chmod(file.name, 0o755)
        self.environment = {**self.environment, "PATH": f"{folder}:{os.environ['PATH']}"}
