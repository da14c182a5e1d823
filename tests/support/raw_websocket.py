"""WebSockets byte by byte, for what no client library would send."""

import base64
import contextlib
import socket
import struct

from .servers import PATIENCE

HANDSHAKE = ("GET {path} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: " + base64.b64encode(b"0123456789abcdef").decode() + "\r\n\r\n")


def connect(server):
    return socket.create_connection(("127.0.0.1", server.port), timeout=PATIENCE)


def read_all(connection):
    """Everything until the server ends the connection; TimeoutError when it does not."""
    parts = []
    try:
        while part := connection.recv(65536):
            parts.append(part)
    except ConnectionResetError:
        pass
    return b"".join(parts)


def read_head(connection):
    """The head of an answer, and not a byte of what follows it."""
    text = b""
    while not text.endswith(b"\r\n\r\n"):
        byte = connection.recv(1)
        if not byte:
            break
        text += byte
    return text


def open_websocket(server, path="/"):
    connection = connect(server)
    connection.sendall(HANDSHAKE.format(path=path).encode())
    head = read_head(connection)
    assert head.startswith(b"HTTP/1.1 101 "), head
    return connection


def frame(first, payload, masked=True):
    """`first`: the first byte, with the bits of FIN and the opcode."""
    length = struct.pack("!B", len(payload)) if len(payload) < 126 else struct.pack("!BQ", 127, len(payload))
    if not masked:
        return bytes([first]) + length + payload
    return bytes([first, length[0] | 0x80]) + length[1:] + b"\0\0\0\0" + payload


def close_code(data):
    """The code of the close frame that data end with."""
    at = data.rfind(b"\x88")
    return struct.unpack("!H", data[at + 2:at + 4])[0]


def answer_to(server, path, data):
    """All that a WebSocket gets back for these bytes until the server closes, which it may do before it has heard us out."""
    with open_websocket(server, path) as browser:
        with contextlib.suppress(ConnectionResetError, BrokenPipeError):
            browser.sendall(data)
        return read_all(browser)
