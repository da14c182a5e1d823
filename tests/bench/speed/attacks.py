#!/usr/bin/python3
"""What attack_rows.py starts against a server: attackers on the load's core, and hostile simulators.

    attacks.py frames PORT PATH MEGABYTES   WebSocket messages of no bytes in frames of six, again and again
    attacks.py pages PORT PATH CLIENTS      clients that ask for a page each and read nothing, again and again
    attacks.py simulator KIND ...           in Webots' place
"""

import contextlib
import os
import resource
import signal
import socket
import sys
import time

HANDSHAKE = ("GET {path} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: MDEyMzQ1Njc4OWFiY2RlZg==\r\n\r\n")
EMPTY_MESSAGE = b"\x81\x80\0\0\0\0"

PROCESSES, FILES = 300, 1000


def frames(port, path, megabytes):
    block = EMPTY_MESSAGE * (int(megabytes) * 1_000_000 // len(EMPTY_MESSAGE))
    while True:
        with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", port)) as connection:
            connection.sendall(HANDSHAKE.format(path=path).encode())
            connection.recv(4096)
            connection.sendall(block)
            connection.sendall(b"\x88\x80\0\0\0\0")
            connection.recv(4096)


def pages(port, path, clients):
    request = f"GET {path} HTTP/1.1\r\nHost: x\r\n\r\n".encode()
    while True:
        connections = []
        for _ in range(int(clients)):
            with contextlib.suppress(OSError):
                connection = socket.socket()
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                connection.connect(("127.0.0.1", port))
                connection.sendall(request)
                connections.append(connection)
        for connection in connections:
            connection.close()


def simulator(kind, arguments):
    if kind == "newlines":
        print(".", flush=True)
        block = b"\n" * 65536
        with contextlib.suppress(OSError):
            while True:
                os.write(1, block)
    port = next(int(argument.partition("=")[2]) for argument in arguments if argument.startswith("--port="))
    resource.setrlimit(resource.RLIMIT_NOFILE, (2 * FILES, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))
    for number in range(PROCESSES):
        if os.fork() == 0:
            for _ in range(FILES):
                os.open("/dev/null", os.O_RDONLY)
            if number == PROCESSES - 1:  # where it is found last
                listener = socket.create_server(("", port))
                assert listener
            signal.pause()
    while True:
        print(".", flush=True)
        time.sleep(1)


if __name__ == "__main__":
    if sys.argv[1] == "simulator":
        simulator(sys.argv[2], sys.argv[3:])
    {"frames": frames, "pages": pages}[sys.argv[1]](int(sys.argv[2]), *sys.argv[3:])
