"""A controller on another machine, as far as libController goes before it speaks its own protocol: what it makes of WEBOTS_CONTROLLER_URL, what
it sends first, and what it reads then (cyberbotics/webots, src/controller/c: robot.c, scheduler.c, percent.c, tcp_client.c; written anew)."""

import hashlib
import re
import socket
import urllib.parse

from .waiting import PATIENCE

# R2022b to R2023a send the path as it was written; later ones encode it, and send a digest of what is longer than 70 bytes then.
OLD, NEW = "R2022b", "R2025a"
ACKNOWLEDGEMENT = 10  # bytes that are read of the answer


def greeting(url, release=NEW):
    """The host, the port, and the first bytes."""
    host, _, rest = url.removeprefix("tcp://").partition(":")
    port = int(re.match(r"\d+", rest).group())
    path = rest.partition("/")[2] if "/" in rest else None
    if path is None:
        return host, port, b"CTR"
    if release != OLD:
        path = urllib.parse.quote(path, safe="-._~")
        if len(path) > 70:
            path = hashlib.sha1(path.encode()).hexdigest()
    return host, port, b"CTR\nRobot-Name: " + path.encode()


class ExternController:
    """A connection for the URL; `answer` is what the library reads of the answer."""

    def __init__(self, url, release=NEW):
        host, port, first = greeting(url, release)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self.socket.settimeout(PATIENCE)
        self.socket.connect((host, port))
        self.socket.sendall(first)
        self.answer = self.socket.recv(ACKNOWLEDGEMENT).decode()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def say(self, line):
        """A line of the demo simulator's protocol, which comes back when it was obeyed."""
        self.socket.sendall(line.encode() + b"\n")
        return self.hear(len(line.encode()) + 1).decode().removesuffix("\n")

    def hear(self, size):
        """So many bytes; fewer when the connection ends before."""
        heard = b""
        while len(heard) < size and (more := self.socket.recv(size - len(heard))):
            heard += more
        return heard

    def hear_all(self):
        heard = b""
        while more := self.socket.recv(1 << 16):
            heard += more
        return heard
