"""A website in PHP's own server, as the websites that start simulations with `init` are made."""

import json
import os
import shutil
import subprocess
import tempfile
import unittest
import urllib.error
import urllib.request

from .archives import zip_of
from .servers import PATIENCE, free_port, wait_until

# The checks and answers of the script that Webots' users install (protocol section 5.3). The archive of a user is a file that
# the test has put there; `X-Test` in its name makes the server misbehave.
DOWNLOAD_PROJECT = r"""<?php
$root = getenv('WEBSITE_FOLDER');
file_put_contents("$root/requests.log", json_encode(['fields' => $_POST, 'agent' => $_SERVER['HTTP_USER_AGENT'] ?? '']) . "\n",
                  FILE_APPEND | LOCK_EX);
header('X-Robots-Tag: noindex');
foreach (['user1Id', 'user1Authentication', 'key', 'project'] as $field)
    if (!isset($_POST[$field]))
        die("Error: Missing $field.");
if ($_POST['key'] !== trim(file_get_contents("$root/key")))
    die('Error: Wrong key.');
$project = $_POST['project'];
if (strpos($project, '/') !== false || strpos($project, '..') !== false)
    die('Error: Wrong project.');
$behaviour = "$root/behaviour.php";
if (is_file($behaviour))
    require $behaviour;
$archive = "$root/user/" . intval($_POST['user1Id']) . "/$project.zip";
if (!is_file($archive))
    die("Error: no such directory: '$project'.");
header('Content-Type: application/zip');
header("Content-disposition: attachment; filename=$project.zip");
header('Content-Length: ' . filesize($archive));
readfile($archive);
"""


def require_php():
    if not shutil.which("php"):
        raise SystemExit(print("skipped: PHP is not installed (package php-cli)") or 77)


class Website:
    """`download-project.php` on a free port of the loopback."""

    def __init__(self, key="the key of this server"):
        self.key = key
        self.folder = tempfile.mkdtemp(prefix="webots_cloud_website_")
        self.process = None

    def __enter__(self):
        os.makedirs(os.path.join(self.folder, "www", "ajax"))
        self.write("www/ajax/download-project.php", DOWNLOAD_PROJECT)
        self.write("key", self.key)
        try:
            self.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def start(self):
        for _ in range(10):  # another program may take the port first
            self.port = free_port()
            self.origin = f"http://localhost:{self.port}"
            with open(os.path.join(self.folder, "php.log"), "ab") as log:
                self.process = subprocess.Popen(
                    ["php", "-S", f"localhost:{self.port}", "-t", os.path.join(self.folder, "www")], stdin=subprocess.DEVNULL,
                    stdout=log, stderr=log, env={**os.environ, "WEBSITE_FOLDER": self.folder, "PHP_CLI_SERVER_WORKERS": "4"},
                    start_new_session=True)
            wait_until(lambda: self.process.poll() is not None or self._answers(), "PHP's server does not answer")
            if self.process.poll() is None:
                return
        raise AssertionError("PHP's server does not start")

    def _answers(self):
        try:
            urllib.request.urlopen(self.origin, timeout=10).close()
        except urllib.error.HTTPError:
            return True  # nothing is at the top
        except OSError:
            return False
        return True

    def __exit__(self, *_):
        if self.process and self.process.poll() is None:
            os.killpg(self.process.pid, 15)  # a group of our own: the server and its workers
            try:
                self.process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                os.killpg(self.process.pid, 9)
                self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def write(self, path, content):
        path = os.path.join(self.folder, path)
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())

    def set_archive(self, content, user="42", project="robots"):
        """What the user gets: files by name, or the bytes of an archive."""
        self.write(f"user/{user}/{project}.zip", content if isinstance(content, bytes) else zip_of(content))

    def set_behaviour(self, code):
        """PHP that runs instead of looking for an archive; empty: none."""
        self.write("behaviour.php", "<?php\n" + code)

    def requests(self):
        """The fields of each request."""
        path = os.path.join(self.folder, "requests.log")
        if not os.path.exists(path):
            return []
        with open(path) as log:
            return [json.loads(line)["fields"] for line in log]
