"""The example of a website that starts simulations, as a process."""

import http.client
import json
import os
import subprocess
import tempfile
import urllib.parse

from .ports import free_port
from .servers import PATIENCE, end, program, wait_until

SOURCE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
DOWNLOAD = "/ajax/download-project.php"
UPLOAD = "/ajax/upload-file.php"
ADA = {"id": 42, "name": "Ada", "email": "ada@example.org", "password": "ada's own"}
BOB = {"id": 7, "name": "Bob", "email": "bob@example.org", "password": "bob's own"}
PROJECTS = [{"name": "robots", "world": "arena.wbt", "controller": "avoid_walls", "title": "Robots in an arena"},
            {"name": "patrol", "world": "patrol.wbt", "controller": "patrol"}]


def multipart(fields, boundary="----WebKitFormBoundaryx"):
    """Type and body of a form as browsers send those with files."""
    parts = []
    for name, value in fields.items():
        value = value if isinstance(value, bytes) else value.encode()
        parts.append(b'--%s\r\nContent-Disposition: form-data; name="%s"\r\n\r\n%s\r\n' % (boundary.encode(), name.encode(), value))
    return f"multipart/form-data; boundary={boundary}", b"".join(parts) + b"--%s--\r\n" % boundary.encode()

# Of the address sanitizer: it reads /proc, which the program keeps itself from (Landlock).
WITHOUT_LEAK_CHECK = {"ASAN_OPTIONS": "detect_leaks=0"}


class WebsiteHost:
    """On a free port of the loopback, in a folder of its own."""

    def __init__(self, session_server="ws://localhost:1", **config):
        self.port = free_port()
        self.origin = f"http://localhost:{self.port}"
        self.config = {"port": self.port, "sessionServer": session_server, "keyFile": "key/localhost", "usersDir": "user",
                       "pageDir": os.path.join(SOURCE, "examples", "website_host", "page"),
                       "users": [ADA, BOB], "projects": PROJECTS, **config}

    def __enter__(self):
        self.temporary = tempfile.TemporaryDirectory(prefix="webots_cloud_website_host_")
        self.folder = self.temporary.name
        self.process = None
        try:
            self.start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        if self.process:
            end(self.process)
        self.temporary.cleanup()

    def start(self):
        path = os.path.join(self.folder, "website.json")
        with open(path, "w") as file:
            json.dump(self.config, file)
        with open(self.log_path, "ab") as log:
            self.process = subprocess.Popen([program("webots-website-host"), path], stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                                            cwd=self.folder, env={**os.environ, **WITHOUT_LEAK_CHECK})
        wait_until(lambda: self.process.poll() is not None or self._answers(), "the website host does not answer")
        if self.process.poll() is not None:
            raise AssertionError(f"the website host ended at once:\n{self.log()}")

    def stop(self):
        self.process.terminate()
        return self.process.wait(PATIENCE)

    def _answers(self):
        try:
            return self.ask("GET", "/site.json")[0] == 200
        except OSError:
            return False

    @property
    def log_path(self):
        return os.path.join(self.folder, "output.log")

    def log(self):
        with open(self.log_path, errors="replace") as file:
            return file.read()

    @property
    def keys(self):
        """The folder that simulation servers need as `keyDir`."""
        return os.path.join(self.folder, "key")

    @property
    def key(self):
        with open(os.path.join(self.keys, "localhost")) as file:
            return file.read().strip()

    def path(self, user, name):
        """Of a file that a user has saved."""
        return os.path.join(self.folder, "user", str(user["id"]), "projects", name)

    def ask(self, method, path, body=None, **headers):
        """Status, headers and body of an answer."""
        connection = http.client.HTTPConnection("localhost", self.port, timeout=PATIENCE)
        try:
            connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read()
        finally:
            connection.close()

    def post(self, path, fields, **headers):
        """The same for a form as PHP and curl send it."""
        return self.ask("POST", path, urllib.parse.urlencode(fields), Content_Type="application/x-www-form-urlencoded", **headers)

    def sign_in(self, user):
        """The cookies of the user, as one header, and the word that stands for the password."""
        status, headers, body = self.post("/ajax/sign-in", {"email": user["email"], "password": user["password"]})
        if (status, body) != (200, b"OK"):
            raise AssertionError(f"{user['name']} can't sign in: {status} {body}")
        cookies = [value.split(";")[0] for value in headers.get_all("Set-Cookie")]
        return "; ".join(cookies), cookies[1].partition("=")[2]

    def save(self, cookies, dirname, filename, content):
        """The answer to a page that saves a file."""
        content_type, body = multipart({"dirname": dirname, "filename": filename, "content": content})
        status, _, answer = self.ask("POST", UPLOAD, body, Content_Type=content_type, Cookie=cookies)
        return answer.decode() if status == 200 else f"{status} {answer.decode()}"
