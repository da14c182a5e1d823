"""Prometheus and its Alertmanager, with the configuration of config/prometheus, on the loopback."""

import json
import os
import shutil
import subprocess
import tempfile
import urllib.error
import urllib.parse
import urllib.request

from .ports import free_port
from .processes import Startable, end_with_parent, required_program
from .servers import PATIENCE, end, wait_until

FOLDER = os.path.join(os.path.dirname(__file__), "../../config/prometheus")


def promtool(*arguments, folder=None, text=None):
    """Runs Prometheus' own checker: whether it is content, and what it says. SkipTest where it is missing."""
    program = required_program("promtool", "prometheus")
    finished = subprocess.run([program, *arguments], input=text, capture_output=True, text=True, cwd=folder, timeout=PATIENCE)
    return finished.returncode == 0, finished.stdout + finished.stderr


class _Program(Startable):
    """A program in a folder of its own, with files of config/prometheus. `changes`: texts in these files, and what the test has instead."""

    PROGRAM = PACKAGE = ""
    FILES = ()

    def __init__(self, changes):
        self.program = required_program(self.PROGRAM, self.PACKAGE)
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_prometheus_")
        self.port = free_port()
        self.process = None
        unused = set(changes)
        for name in self.FILES:
            with open(os.path.join(FOLDER, name)) as file:
                text = file.read()
            for theirs in [theirs for theirs in changes if theirs in text]:
                text = text.replace(theirs, changes[theirs])
                unused.discard(theirs)
            with open(os.path.join(self.folder, name), "w") as file:
                file.write(text)
        assert not unused, f"{self.FILES} do not mention {unused} any more"

    def options(self):
        """Of the command line."""
        raise NotImplementedError

    def start(self):
        log_path = os.path.join(self.folder, "log")
        with open(log_path, "w") as log:
            self.process = subprocess.Popen([self.program, *self.options()], cwd=self.folder, stdin=subprocess.DEVNULL, stdout=log,
                                            stderr=log, preexec_fn=end_with_parent)
        wait_until(lambda: self.process.poll() is not None or self.is_ready(), f"{self.PROGRAM} is not ready")
        if self.process.poll() is not None:
            with open(log_path) as log:
                raise AssertionError(f"{self.PROGRAM} ended at once:\n{log.read()}")

    def is_ready(self):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.port}/-/ready", timeout=PATIENCE) as answer:
                return answer.status == 200
        except (urllib.error.URLError, ConnectionError):
            return False

    def close(self):
        if self.process:
            end(self.process)
        shutil.rmtree(self.folder, ignore_errors=True)


class Prometheus(_Program):
    """Asks five times a second what the configuration asks four times a minute."""

    PROGRAM = PACKAGE = "prometheus"
    FILES = ("prometheus.yml", "alerts.yml")

    def __init__(self, changes, alertmanager=None):
        alerts_go_to = alertmanager.port if alertmanager else free_port()
        super().__init__({"_interval: 15s": "_interval: 200ms", "localhost:9093": f"localhost:{alerts_go_to}", **changes})

    def options(self):
        return ("--config.file=prometheus.yml", "--storage.tsdb.path=data", f"--web.listen-address=127.0.0.1:{self.port}", "--log.level=warn")

    def ask(self, path, **parameters):
        """What its HTTP API answers; an error is raised."""
        address = f"http://127.0.0.1:{self.port}/api/v1/{path}?{urllib.parse.urlencode(parameters)}"
        with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
            return json.load(answer)["data"]

    def query(self, expression):
        """Label sets with their values now."""
        return [(each["metric"], float(each["value"][1])) for each in self.ask("query", query=expression)["result"]]


class Alertmanager(_Program):
    """Sends mails without TLS, to a mail server of the test's."""

    PROGRAM = PACKAGE = "prometheus-alertmanager"
    FILES = ("alertmanager.yml",)

    def __init__(self, mail_port):
        super().__init__({"mail.example.org:587": f"127.0.0.1:{mail_port}", "smtp_from:": "smtp_require_tls: false\n  smtp_from:",
                          "group_wait: 30s": "group_wait: 1s"})

    def options(self):
        return ("--config.file=alertmanager.yml", "--storage.path=data", f"--web.listen-address=127.0.0.1:{self.port}",
                "--cluster.listen-address=", "--log.level=warn")
