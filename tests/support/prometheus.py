"""A Prometheus of the test's own, with the configuration of config/prometheus, on the loopback."""

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


class Prometheus(Startable):
    """Asks five times a second what the configuration asks four times a minute. `targets`: by the address in the configuration, those of the test."""

    def __init__(self, targets):
        self.program = required_program("prometheus", "prometheus")
        with open(os.path.join(FOLDER, "prometheus.yml")) as file:
            text = file.read()
        for theirs, ours in {"_interval: 15s": "_interval: 200ms", "localhost:9093": f"localhost:{free_port()}", **targets}.items():
            assert theirs in text, f"prometheus.yml does not mention {theirs} any more"
            text = text.replace(theirs, ours)
        self.configuration = text
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_prometheus_")
        self.port = free_port()
        self.process = None

    def start(self):
        with open(os.path.join(self.folder, "prometheus.yml"), "w") as file:
            file.write(self.configuration)
        shutil.copy(os.path.join(FOLDER, "alerts.yml"), self.folder)
        with open(os.path.join(self.folder, "log"), "w") as log:
            self.process = subprocess.Popen([self.program, "--config.file=prometheus.yml", "--storage.tsdb.path=data",
                                             f"--web.listen-address=127.0.0.1:{self.port}", "--log.level=warn"],
                                            cwd=self.folder, stdin=subprocess.DEVNULL, stdout=log, stderr=log, preexec_fn=end_with_parent)
        wait_until(lambda: self.process.poll() is not None or self.is_ready(), "Prometheus is not ready")
        if self.process.poll() is not None:
            with open(os.path.join(self.folder, "log")) as log:
                raise AssertionError(f"Prometheus ended at once:\n{log.read()}")

    def is_ready(self):
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self.port}/-/ready", timeout=PATIENCE) as answer:
                return answer.status == 200
        except (urllib.error.URLError, ConnectionError):
            return False

    def ask(self, path, **parameters):
        """What its HTTP API answers; an error is raised."""
        address = f"http://127.0.0.1:{self.port}/api/v1/{path}?{urllib.parse.urlencode(parameters)}"
        with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
            return json.load(answer)["data"]

    def query(self, expression):
        """Label sets with their values now."""
        return [(each["metric"], float(each["value"][1])) for each in self.ask("query", query=expression)["result"]]

    def close(self):
        if self.process:
            end(self.process)
        shutil.rmtree(self.folder, ignore_errors=True)
