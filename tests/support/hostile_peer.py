"""Hostile web and git servers, whose answers are endless, or small but large when unpacked. They serve on the loopback interface
until the client closes; the memory of their victims is measured elsewhere."""

import hashlib
import itertools
import socket
import struct
import threading
import zlib

COMMIT = "a" * 40


def frame(payload):
    """A line of git's protocol."""
    payload = payload if isinstance(payload, bytes) else payload.encode()
    return b"%04x" % (len(payload) + 4) + payload


def varint(number):
    out = b""
    while True:
        out += bytes([number & 0x7F | (0x80 if number >> 7 else 0)])
        number >>= 7
        if not number:
            return out


def entry(kind, size, compressed, extra=b""):
    """An object of a pack that claims to have `size` bytes."""
    byte = (kind << 4) | (size & 15)
    size >>= 4
    head = b""
    while size:
        head += bytes([byte | 0x80])
        byte = size & 0x7F
        size >>= 7
    return head + bytes([byte]) + extra + compressed


def zeros(size):
    """This many bytes, compressed."""
    packer = zlib.compressobj(9)
    block = b"\0" * (1 << 20)
    parts = [packer.compress(block[:min(len(block), size - at)]) for at in range(0, size, len(block))]
    return b"".join(parts) + packer.flush()


def distance(number):
    """The distance from a delta back to its base, as packs encode it."""
    out = bytes([number & 0x7F])
    number >>= 7
    while number:
        number -= 1
        out = bytes([0x80 | number & 0x7F]) + out
        number >>= 7
    return out


def packed(entries):
    """The answer to a fetch: a pack."""
    content = b"PACK" + struct.pack(">II", 2, len(entries)) + b"".join(entries)
    content += hashlib.sha1(content).digest()
    chunks = [content[i:i + 60_000] for i in range(0, len(content), 60_000)]
    return frame("packfile\n") + b"".join(frame(b"\1" + chunk) for chunk in chunks) + b"0000"


def pack_of_deltas(size=512 << 20):
    """Less than half a megabyte that unpacks to a file of `size` bytes and, by a delta in memory, to another one."""
    base = entry(3, 65536, zeros(65536))
    first = varint(65536) + varint(size) + b"\x80" * (size // 65536)  # a byte copies 64 KiB
    first_entry = entry(6, len(first), zlib.compress(first, 9), distance(len(base)))
    largest = 0xFF0000
    second = varint(size) + varint(size) + b"\xc0\xff" * (size // largest)
    rest = size % largest
    second += b"\xf0" + struct.pack("<I", rest)[:3] if rest else b""
    return packed([base, first_entry, entry(6, len(second), zlib.compress(second, 9), distance(len(first_entry)))])


def pack_of_folders(size=255 << 20):
    """One folder, which is kept in memory."""
    return packed([entry(2, size, zeros(size))])


def pack_of_waiting_deltas(size=255 << 20):
    """A delta is kept in memory until its base comes, which never does."""
    return packed([entry(7, size, zeros(size), b"\1" * 20)])


def pack_of_tiny_files(count=400_000):
    return packed([entry(3, 4, zlib.compress(struct.pack(">I", i), 1)) for i in range(count)])


CHUNKED = b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n"
REFS = frame(f"{COMMIT} refs/heads/main\n") + b"0000"


def whole(body):
    return [b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\n\r\n" % len(body), body]


def chunk(content):
    return b"%x\r\n" % len(content) + content + b"\r\n"


def endless(beginning, piece):
    return itertools.chain([beginning], itertools.repeat(piece))


# Endless answers; `{body}` is the body of a valid one.
ENDLESS = {
    "headers": lambda body: endless(b"HTTP/1.1 200 OK\r\n", b"X-Header: y\r\n" * 5000),
    "interim": lambda body: endless(b"", b"HTTP/1.1 100 Continue\r\nX: y\r\n\r\n" * 2000),
    "trailers": lambda body: endless(CHUNKED + chunk(body) + b"0\r\n", b"X-Trailer: y\r\n" * 5000),
    "trailer": lambda body: endless(CHUNKED + chunk(body) + b"0\r\nX: ", b"y" * 65536),
    "extension": lambda body: endless(CHUNKED + b"1;", b"x" * 65536),
    "extensions": lambda body: endless(CHUNKED, (b"1;" + b"x" * 8000 + b"\r\na\r\n") * 8),
    "body": lambda body: endless(CHUNKED, chunk(b"x" * 65536)),
}


class HostilePeer:
    """Answers each request with the pieces of `answer(path, body of the request)`."""

    def __init__(self, answer, address="127.0.0.1"):
        self.answer = answer
        self.listener = socket.create_server((address, 0), backlog=256)
        self.port = self.listener.getsockname()[1]
        self.over = False
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self):
        self.over = True
        try:
            self.listener.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self.listener.close()

    def _accept(self):
        while not self.over:
            try:
                connection, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self._converse, args=(connection,), daemon=True).start()

    def _converse(self, connection):
        with connection:
            try:
                while self._answer_one(connection):
                    pass
            except OSError:
                pass  # who is attacked leaves: that is what is tested

    def _answer_one(self, connection):
        head = b""
        while b"\r\n\r\n" not in head:
            more = connection.recv(65536)
            if not more:
                return False
            head += more
        head, _, body = head.partition(b"\r\n\r\n")
        lines = head.decode("latin-1").split("\r\n")
        length = next((int(line[15:]) for line in lines if line.lower().startswith("content-length:")), 0)
        while len(body) < length:
            more = connection.recv(65536)
            if not more:
                return False
            body += more
        for piece in self.answer(lines[0].split(" ")[1], body):
            if self.over:
                return False
            connection.sendall(piece)
        return True


class HostileGitServer(HostilePeer):
    """`/evil/<attack>.git` answers a request for refs with that attack of ENDLESS, `pack-<attack>` a request for files; or a name of `packs`."""

    def __init__(self, packs):
        self.packs = {name: whole(body) for name, body in packs.items()}
        super().__init__(self._attack)
        self.url = f"http://127.0.0.1:{self.port}"

    def world(self, attack, number=0):
        return f"{self.url}/evil{number}/{attack}/blob/main/worlds/a.wbt"

    def _attack(self, path, body):
        name = path.split("/")[2].removesuffix(".git")
        asks_for_refs = b"command=ls-refs" in body or not body
        if name.startswith("pack-"):
            name = name[5:]
            if asks_for_refs:
                return whole(REFS)
        elif name in self.packs:
            return whole(REFS) if asks_for_refs else self.packs[name]
        return ENDLESS[name](REFS if asks_for_refs else packed([]))
