#!/usr/bin/python3
"""Stands in for Webots, and answers whatever would bind a visitor's browser to somebody else: `webots` of a "webotsHome" that `make_home` makes.

What it is asked is written to the file `asked` beside it: a line of JSON for each request. Its answers have, besides what the file `answers` there
lists, `Refresh` below /refresh, and 401 below /secret.
"""

import base64
import contextlib
import hashlib
import http.server
import json
import os
import re
import shutil
import sys

FOLDER = os.path.dirname(os.path.abspath(__file__))
TYPES = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}
SECRET = {"WWW-Authenticate": 'Basic realm="monitor", charset="UTF-8"'}
REFRESH = {"Refresh": "0; url=/monitor"}


def make_home(folder, answers):
    """A "webotsHome" whose simulator adds these header fields to each answer."""
    program = os.path.join(folder, "webots")
    shutil.copy(__file__, program)
    os.chmod(program, 0o755)
    with open(os.path.join(folder, "answers"), "w") as file:
        json.dump(answers, file)


def asked(folder):
    """What simulators of this folder were asked: (path, fields with names in lower case)."""
    with contextlib.suppress(FileNotFoundError), open(os.path.join(folder, "asked")) as file:
        return [(line["path"], line["headers"]) for line in map(json.loads, file)]
    return []


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_GET(self):
        with open(os.path.join(FOLDER, "asked"), "a") as file:
            file.write(json.dumps({"path": self.path, "headers": {name.lower(): value for name, value in self.headers.items()}}) + "\n")
        if "Upgrade" in self.headers:
            return self.accept()
        is_secret = self.path.startswith("/secret")
        more = SECRET if is_secret else REFRESH if self.path.startswith("/refresh") else {}
        kind = TYPES.get(os.path.splitext(self.path)[1], "text/html")
        self.say(401 if is_secret else 200, more, kind, b"<!DOCTYPE html><title>hostile</title><main>hostile</main>" if kind == "text/html" else b"/* */")

    def accept(self):
        key = self.headers["Sec-WebSocket-Key"] + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
        accepted = base64.b64encode(hashlib.sha1(key.encode()).digest()).decode()
        self.say(101, {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Accept": accepted})
        with contextlib.suppress(OSError):
            while self.rfile.read(1):
                pass
        self.close_connection = True

    def say(self, status, more, kind="", body=b""):
        with open(os.path.join(FOLDER, "answers")) as file:
            hostile = json.load(file)
        with contextlib.suppress(OSError):
            self.send_response(status)
            entity = {"Content-Type": kind, "Content-Length": len(body)} if kind else {}
            for name, value in {**hostile, **more, **entity}.items():
                self.send_header(name, str(value))
            self.end_headers()
            self.wfile.write(body)

    def log_message(self, *_):
        pass


if __name__ == "__main__":
    port = int(re.search(r"port=(\d+)", " ".join(sys.argv[1:]))[1])
    server = http.server.ThreadingHTTPServer(("127.0.0.1", port), Handler)
    print("open", flush=True)
    server.serve_forever()
